#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "waymark/families/family.hpp"
#include "waymark/tags/surroundings.hpp"

namespace waymark::refinement {

/// The cells inside the border square of a tag, each as its share (0 or 1) of white; 0.5 where none is known.
class BitCells {
 public:
  /// Requires an id that exists in the family. O(cells).
  explicit BitCells(const TagId& id) : cells_(family(id.family).width_at_border) {
    const Family& table = family(id.family);
    white_.fill(0.5F);
    const float border = table.reversed_border ? 1.0F : 0.0F;
    for (int i = 0; i < cells_; ++i)
      for (const int edge : {0, cells_ - 1}) white(i, edge) = white(edge, i) = border;
    const std::uint64_t code = table.codes[static_cast<std::size_t>(id.number)];
    for (std::size_t bit = 0; bit < table.bits.size(); ++bit) {
      const auto [x, y] = table.bits[bit];
      if (x < 0 || y < 0 || x >= cells_ || y >= cells_) continue;
      white(x, y) = ((code >> (table.bits.size() - 1 - bit)) & 1U) != 0 ? 1.0F : 0.0F;
    }
  }

  /// Of the cell at column x and row y; the colour outside the border beyond the square.
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
