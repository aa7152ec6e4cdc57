#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "waymark/families/family.hpp"
#include "waymark/tags/refinement/edge_model.hpp"

namespace waymark::refinement {

/// The share of white (0 or 1) in each cell inside the border square of a tag; 0.5 if unknown.
class BitCells {
 public:
  /// The id must exist in the family. O(cells).
  explicit BitCells(const PrintedTag& print) : cells_(family(print.id.family).width_at_border) {
    const TagId& id = print.id;
    const Family& table = family(id.family);
    white_.fill(0.5F);
    const float border = print.bright_border() ? 1.0F : 0.0F;
    for (int i = 0; i < cells_; ++i)
      for (const int edge : {0, cells_ - 1}) white(i, edge) = white(edge, i) = border;
    const std::uint64_t code = table.codes[static_cast<std::size_t>(id.number)];
    for (std::size_t bit = 0; bit < table.bits.size(); ++bit) {
      const auto [x, y] = table.bits[bit];
      if (x < 0 || y < 0 || x >= cells_ || y >= cells_) continue;
      const bool one = ((code >> (table.bits.size() - 1 - bit)) & 1U) != 0;
      white(x, y) = one != print.inverted ? 1.0F : 0.0F;
    }
  }

  /// Share of white in the cell at column x and row y; outside the square, that of the colour outside the
  /// border.
  [[nodiscard]] float at(int x, int y) const {
    if (x < 0 || y < 0 || x >= cells_ || y >= cells_) return 1.0F - white_[0];
    return white_[at_index(x, y)];
  }

 private:
  static std::size_t at_index(int x, int y) {
    return static_cast<std::size_t>(y) * kMaxCells + static_cast<std::size_t>(x);
  }
  float& white(int x, int y) { return white_[at_index(x, y)]; }

  int cells_ = 0;
  std::array<float, static_cast<std::size_t>(kMaxCells) * kMaxCells> white_{};
};

}  // namespace waymark::refinement
