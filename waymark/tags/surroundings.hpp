#pragma once

#include <array>

#include "waymark/families/family.hpp"

namespace waymark::refinement {

inline constexpr int kMaxCells =
    16;  ///< cells along the border square of a tag; AprilTag's families have 3 to 8

/// A row of cells parallel to one border edge, in the order of that edge's corners, each as its share (0 or
/// 1) of the colour just outside the border: white for most families, black where the border is reversed.
using CellRow = std::array<float, kMaxCells>;

/// What is printed near one border edge. The border itself is one cell wide on either side of the edge.
struct Surroundings {
  int cells = 0;              ///< cells along the edge
  CellRow behind{};           ///< the row behind the inner border ring: the outermost data bits
  CellRow beyond{};           ///< the row beyond the ring outside the border, where the family has bits there
  bool beyond_known = false;  ///< false: what lies there is not printed with the tag (margin, wall, ...)
};

/// The surroundings of the four edges TL-TR, TR-BR, BR-BL, BL-TL of a tag. Requires an id that exists in the
/// family. O(data bits).
[[nodiscard]] std::array<Surroundings, 4> tag_surroundings(const TagId& id);

}  // namespace waymark::refinement
