#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/image/image.hpp"

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

/// A flat thing with a pattern of rectangular grey cells: a tag with its paper, or a printed sheet. Plane
/// frame as that of a tag: x right, y down, z into the paper, as its reader sees it.
struct PlanarPattern {
  std::vector<double> x_lines_m;  ///< where columns of cells begin, and where the last one ends; increasing
  std::vector<double> y_lines_m;  ///< the same for rows
  Image levels;                   ///< one pixel a cell: 0 ink to 255 paper
  SE3 cam_T_plane;

  /// Whether the camera sees the printed side.
  [[nodiscard]] bool faces_camera() const { return cam_T_plane.inverse().translation().z() < 0; }
};

/// Neighbouring cells of one level as one rectangle [m].
struct PatternRect {
  double left = 0, top = 0, right = 0, bottom = 0;
  double level = 0;
};

/// The cells as few rectangles: runs along a row, and rows that repeat the one above taken together. They
/// tile the pattern. O(cells).
[[nodiscard]] std::vector<PatternRect> merged_cells(const PlanarPattern& pattern);

/// A pattern as a camera sees it: polygons in pixels.
struct ProjectedPattern {
  struct Piece {
    std::size_t begin = 0, end = 0;  ///< its corners, clockwise as seen
    double level = 0;
    double y_min = 0, y_max = 0;  ///< [px]
  };
  std::vector<Eigen::Vector2d> corners_px;
  std::vector<Piece> pieces;
  Eigen::Vector2d min_px = Eigen::Vector2d::Zero();  ///< of all corners
  Eigen::Vector2d max_px = Eigen::Vector2d::Zero();
};

/// Projects a pattern. Under distortion an edge becomes a chain of chords that leave it by less than 1e-4 px.
/// What lies beyond the domain of the camera is left out, up to a narrow rim (rectangles across the limit are
/// halved twelve times). Seen from behind, a pattern is blank paper.
[[nodiscard]] ProjectedPattern project_pattern(const CameraModel& camera, const PlanarPattern& pattern);

/// How a pixel gathers light: the square of the pixel, spread by a Gaussian lens. As weights for cells of 1/n
/// px, because light is gathered from a grid finer than the pixels (see render_planes).
struct PointSpread {
  int cells_per_px = 1;  ///< n
  int reach_px = 0;      ///< whole pixels beyond the pixel itself that the weights cover, on either side
  std::vector<double> weights;  ///< of the n (1 + 2 reach_px) cells of a row, sum 1, symmetric

  friend bool operator==(const PointSpread&, const PointSpread&) = default;
};

/// The weights for a lens with standard deviation sigma_px; below 0.05 px there is no lens, only the pixel. A
/// weight is the mean over its cell of box * Gaussian; the variance this and the cells add, 1 / (6 n^2), is
/// taken off the Gaussian's.
[[nodiscard]] PointSpread point_spread(double sigma_px);

/// What the pixels of a camera gather from flat patterns, row by row.
struct SceneLight {
  int width = 0, height = 0;   ///< [px]
  std::vector<float> covered;  ///< share of the pixel's light that comes from a pattern, 0 to 1
  std::vector<float> level;    ///< sum of share times level (0 ink to 255 paper)

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// Light of patterns, the last one nearest to the camera: it covers those before it. Exact areas on a grid of
/// spread.cells_per_px cells a pixel, gathered with spread.weights. Time goes with the pixels around
/// patterns; memory with some rows of them.
[[nodiscard]] SceneLight gather_light(std::span<const ProjectedPattern> patterns, int width_px, int height_px,
                                      const PointSpread& spread);

}  // namespace waymark::photo
