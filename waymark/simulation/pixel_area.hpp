#pragma once

#include <vector>

#include "waymark/simulation/row_major.hpp"

namespace waymark::render {

/// The pattern of a flat rectangle: square cells in its middle, a margin around them, nothing beyond. In
/// units of a cell, with the origin at the top left corner of the cells; a plain rectangle has no cells, and
/// its units are arbitrary. Lines 0 .. lines() - 1 of either direction part columns (rows) 0 .. lines(); the
/// first and the last of them are outside.
struct PatternGrid {
  int cells = 0;  ///< in a row; at most kMostCells
  float left = 0, right = 0, top = 0, bottom = 0;
  std::vector<float> levels;  ///< reflectance of row r, column c at r * (lines() + 1) + c; outside 0

  static constexpr int kMostCells = 16;

  [[nodiscard]] int lines() const { return cells > 0 ? cells + 3 : 2; }
  [[nodiscard]] float column_line(int k) const {
    return k == 0 ? left : (k == lines() - 1 ? right : static_cast<float>(k - 1));
  }
  [[nodiscard]] float row_line(int k) const {
    return k == 0 ? top : (k == lines() - 1 ? bottom : static_cast<float>(k - 1));
  }
  [[nodiscard]] float level(int row, int column) const { return levels[row_major(row, lines() + 1, column)]; }
  [[nodiscard]] bool covers(int row, int column) const {
    return row > 0 && column > 0 && row < lines() && column < lines();
  }
};

/// Where the line of sight of a pixel's corner meets the plane: at (a / c, b / c), before the camera if c >
/// 0.
struct PlanePoint {
  float a = 0, b = 0, c = 0;
};

/// The columns and rows a pixel may touch.
struct CellSpan {
  int column_low = 0, column_high = 0, row_low = 0, row_high = 0;
};

/// Which part of a pixel a pattern covers, and the sum of reflectance times part.
struct PixelShare {
  float covered = 0;
  float level = 0;
};

/// Exact areas: the pixel's square is cut along the lines of the pattern. a, b, c are taken as linear between
/// the corners, which they are without distortion; with it the error is of the bend within a pixel. Corners
/// clockwise from the top left one. c may be 0 or less at some of them (the horizon). O(cells touched).
[[nodiscard]] PixelShare share_of_pixel(const PatternGrid& grid, const PlanePoint (&corners)[4],
                                        const CellSpan& span);

}  // namespace waymark::render
