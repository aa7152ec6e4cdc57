#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "waymark/families/family.hpp"
#include "waymark/tags/refinement/edge_model.hpp"

namespace waymark::refinement {

/// Colours of the cells inside the border and of the ring around it.
class CellColors {
 public:
  explicit CellColors(const PrintedTag& print) : width_(family(print.id.family).width_at_border) {
    const Family& table = family(print.id.family);
    color_.fill(Color::Unknown);
    const bool bright = print.bright_border();
    for (int k = -1; k <= width_; ++k)
      for (const int edge : {-1, width_}) at(k, edge) = at(edge, k) = bright ? Color::Black : Color::White;
    for (int k = 0; k < width_; ++k)
      for (const int edge : {0, width_ - 1}) at(k, edge) = at(edge, k) = bright ? Color::White : Color::Black;
    const std::uint64_t code = table.codes[static_cast<std::size_t>(print.id.number)];
    for (std::size_t bit = 0; bit < table.bits.size(); ++bit) {
      const auto [x, y] = table.bits[bit];
      if (x < 0 || y < 0 || x >= width_ || y >= width_) continue;
      const bool one = ((code >> (table.bits.size() - 1 - bit)) & 1U) != 0;
      at(x, y) = one != print.inverted ? Color::White : Color::Black;
    }
  }

  [[nodiscard]] int width() const { return width_; }
  /// The change from cell a to cell b: 1 to white, -1 to black, 0 if there is no change or it is unknown.
  [[nodiscard]] int change(int ax, int ay, int bx, int by) const {
    const Color a = get(ax, ay);
    const Color b = get(bx, by);
    if (a == Color::Unknown || b == Color::Unknown || a == b) return 0;
    return b == Color::White ? 1 : -1;
  }

 private:
  enum class Color : std::uint8_t { Black, White, Unknown };
  static constexpr int kSide = kMaxCells + 2;
  static std::size_t index(int x, int y) {
    return static_cast<std::size_t>(y + 1) * kSide + static_cast<std::size_t>(x + 1);
  }
  Color& at(int x, int y) { return color_[index(x, y)]; }
  [[nodiscard]] Color get(int x, int y) const { return color_[index(x, y)]; }

  int width_;
  std::array<Color, static_cast<std::size_t>(kSide) * kSide> color_{};
};

}  // namespace waymark::refinement
