#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace waymark::photo {

/// Which part of each cell of a grid polygons cover, and with what value: exact areas, no samples.
///
/// Every edge adds, to the cells of the rows it crosses, the area between itself and the right end of the
/// row; the sums along the rows are then the covered areas (the signed-area accumulation of font rasterisers,
/// e.g. Levien, "Inside the fastest font renderer in the world", 2016). The result is exact up to rounding,
/// whatever the size of the polygons.
class Coverage {
 public:
  /// Fraction of a cell that is covered, and the sum of value times fraction.
  struct Cell {
    double covered = 0;
    double value = 0;
  };

  /// Forgets all polygons; the grid is now [0, width) x [0, height) cells.
  void reset(int width, int height);

  /// Adds a polygon. Corners in cells, clockwise as seen (x right, y down); anticlockwise ones count
  /// negatively. They may lie outside the grid. O(rows crossed + cells crossed).
  void add(std::span<const Eigen::Vector2d> corners, double value);

  /// Sums up row y, once after the last add(); width() cells.
  [[nodiscard]] std::span<const Cell> finish_row(int y);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

 private:
  void add_edge(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double value);
  void add_in_row(int y, double x_from, double x_to, double height, double value);
  void add_area(int y, int x, double area, double value);

  int width_ = 0;
  int height_ = 0;
  std::vector<Cell> cells_;  ///< one column more than the grid: what lies right of it
};

}  // namespace waymark::photo
