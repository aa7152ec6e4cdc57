#pragma once

#include <cstddef>
#include <vector>

#include "waymark/families/family.hpp"
#include "waymark/plot/drawing.hpp"

namespace waymark::plot {

/// A square of cells, row by row from its top left corner; true for ink.
struct Cells {
  int width = 0;
  std::vector<bool> ink;

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
  [[nodiscard]] bool at(int x, int y) const { return ink[index(x, y)]; }
};

/// The ink of a tag, total_width cells wide. Cells outside the tag (in the corners of circular families) stay
/// white. The number must exist in the family.
[[nodiscard]] Cells tag_cells(const TagId& tag);

/// The same tag with a two-cell black border and no white margin, as printed and read by Kalibr (wiki of
/// github.com/ethz-asl/kalibr, "Calibration targets"); it is width_at_border + 2 cells wide. Only for
/// families whose black border is on the outside (reversed_border false).
[[nodiscard]] Cells two_cell_border(const TagId& tag);

/// The outline of the inked area as closed loops of corner points. No two loops share an edge, so renderers
/// cannot leave a seam between neighbouring cells. `place` is the position of the square of cells on the
/// page. O(cells).
[[nodiscard]] std::vector<std::vector<Point>> outline(const Cells& cells, const Box& place);

}  // namespace waymark::plot
