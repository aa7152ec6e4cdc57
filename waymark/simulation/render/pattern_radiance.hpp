#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/image/image.hpp"

namespace waymark::photo {

/// Area of each grid cell that is covered by polygons, weighted with a value. Areas are exact; there is no
/// sampling.
///
/// In each row that it crosses, an edge adds to the cells the area between itself and the right end of the
/// row. The sums along the rows are the covered areas (the signed-area accumulation used by font rasterisers,
/// e.g. Levien, "Inside the fastest font renderer in the world", 2016). The result is exact up to rounding
/// for polygons of any size.
class Coverage {
 public:
  /// Covered fraction of a cell, and the sum of value times fraction.
  struct Cell {
    double covered = 0;
    double value = 0;
  };

  /// Removes all polygons and sets the grid to [0, width) x [0, height) cells.
  void reset(int width, int height);

  /// Adds a polygon. Its corners are in units of cells, clockwise in the image (x right, y down);
  /// anticlockwise polygons are subtracted. Corners may lie outside the grid. O(rows crossed + cells
  /// crossed).
  void add(std::span<const Eigen::Vector2d> corners, double value);

  /// Computes the sums for row y, which has width() cells. Must be called once per row, after the last add().
  [[nodiscard]] std::span<const Cell> finish_row(int y);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

 private:
  void add_edge(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double value);
  void add_in_row(int y, double x_from, double x_to, double height, double value);
  void add_area(int y, int x, double area, double value);

  int width_ = 0;
  int height_ = 0;
  std::vector<Cell> cells_;  ///< one more column than the grid, for the area to its right
};

/// A flat object with a pattern of rectangular grey cells, such as a tag with its paper or a printed sheet.
/// The plane frame is like that of a tag, as seen by its viewer: x right, y down, z into the paper.
struct PlanarPattern {
  std::vector<double> x_lines_m;  ///< left edges of the columns and right edge of the last; increasing
  std::vector<double> y_lines_m;  ///< the same for the rows
  Image levels;                   ///< one pixel per cell, from 0 (ink) to 255 (paper)
  SE3 cam_T_plane;

  /// Whether the printed side faces the camera.
  [[nodiscard]] bool faces_camera() const { return cam_T_plane.inverse().translation().z() < 0; }
};

/// Neighbouring cells with the same level, combined into one rectangle [m].
struct PatternRect {
  double left = 0, top = 0, right = 0, bottom = 0;
  double level = 0;
};

/// Merges the cells into a small number of rectangles that tile the pattern: runs along a row, combined over
/// identical rows. O(cells).
[[nodiscard]] std::vector<PatternRect> merged_cells(const PlanarPattern& pattern);

/// A pattern projected into the image, as polygons in pixels.
struct ProjectedPattern {
  struct Piece {
    std::size_t begin = 0, end = 0;  ///< range of its corners, clockwise in the image
    double level = 0;
    double y_min = 0, y_max = 0;  ///< vertical extent [px]
  };
  std::vector<Eigen::Vector2d> corners_px;
  std::vector<Piece> pieces;
  Eigen::Vector2d min_px = Eigen::Vector2d::Zero();  ///< bounding box of all corners
  Eigen::Vector2d max_px = Eigen::Vector2d::Zero();
};

/// Projects a pattern. With distortion, an edge becomes a chain of chords that deviate from it by less than
/// 1e-4 px. Parts outside the domain of the camera are omitted, up to a narrow rim (rectangles across the
/// limit are halved twelve times). A pattern seen from behind is blank paper.
[[nodiscard]] ProjectedPattern project_pattern(const CameraModel& camera, const PlanarPattern& pattern);

/// Response of a pixel: the pixel square convolved with a Gaussian lens blur. It consists of weights for
/// cells of 1/n px, because radiance is integrated on a grid finer than the pixels (see render_planes).
struct PointSpread {
  int cells_per_px = 1;         ///< the n above
  int reach_px = 0;             ///< number of whole pixels on either side of the pixel that the weights cover
  std::vector<double> weights;  ///< for the n (1 + 2 reach_px) cells of a row; symmetric, with sum 1

  friend bool operator==(const PointSpread&, const PointSpread&) = default;
};

/// The weights for a lens with standard deviation sigma_px; below 0.05 px there is no lens blur, only the
/// pixel. A weight is the mean of box * Gaussian over its cell. The variance that is added by this averaging
/// and by the cells, 1 / (6 n^2), is subtracted from that of the Gaussian.
[[nodiscard]] PointSpread point_spread(double sigma_px);

/// Radiance of flat patterns integrated over the pixels of a camera.
struct SceneRadiance {
  int width = 0, height = 0;   ///< [px]
  std::vector<float> covered;  ///< fraction of the pixel's radiance that comes from a pattern, 0 to 1
  std::vector<float> level;    ///< sum of fraction times level, from 0 (ink) to 255 (paper)

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// Radiance of patterns that are ordered from far to near: later patterns cover earlier ones. The areas are
/// exact, on a grid of spread.cells_per_px cells per pixel, and weighted with spread.weights. The time is
/// proportional to the number of pixels around the patterns, the memory to a few rows of them.
[[nodiscard]] SceneRadiance gather_radiance(std::span<const ProjectedPattern> patterns, int width_px,
                                            int height_px, const PointSpread& spread);

}  // namespace waymark::photo
