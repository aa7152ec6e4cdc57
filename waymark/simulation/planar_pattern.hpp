#pragma once

#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/image/image.hpp"

namespace waymark::photo {

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

}  // namespace waymark::photo
