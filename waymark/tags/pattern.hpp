#pragma once

#include <array>
#include <cstddef>

#include "waymark/families/family.hpp"

namespace waymark::refinement {

inline constexpr int kMaxCells = 16;  ///< cells along the border square; AprilTag's families have 3 to 10

/// The cells of a printed tag by rows and columns from -kRing to cells + kRing - 1, each as its share (0 or
/// 1) of white. What lies beyond the white margin counts as white, and is known to be unknown.
struct Pattern {
  static constexpr int kRing = 4;
  static constexpr int kSide = kMaxCells + 2 * kRing;
  int cells = 0;  ///< along the border square
  int ring = 1;   ///< cells outside the border square that are printed with the tag
  std::array<std::array<float, kSide>, kSide> white{};
  std::array<std::array<bool, kSide>, kSide> known{};

  [[nodiscard]] float white_at(int x, int y) const { return white[index(y)][index(x)]; }
  [[nodiscard]] bool known_at(int x, int y) const { return known[index(y)][index(x)]; }
  [[nodiscard]] static std::size_t index(int cell) {
    const int at = cell + kRing;
    return static_cast<std::size_t>(at);
  }
};

/// The pattern of a tag. Requires an id that exists in the family. O(cells).
[[nodiscard]] Pattern tag_pattern(const TagId& id);

}  // namespace waymark::refinement
