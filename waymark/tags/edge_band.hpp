#pragma once

#include <array>

#include <Eigen/Core>

#include "waymark/image/image.hpp"
#include "waymark/tags/edge_sums.hpp"
#include "waymark/tags/lanes.hpp"
#include "waymark/tags/surroundings.hpp"

namespace waymark::refinement {

inline constexpr int kMaxSlices = 64;  ///< of one edge; longer edges are sampled sparsely
inline constexpr int kMaxDepth = 24;   ///< pixels in one slice
inline constexpr int kMaxBlocks = kMaxSlices / kLanes;

using Quad = std::array<Eigen::Vector2d, 4>;

/// One border edge of a quad and what lies parallel to it, in pixels.
struct EdgeFrame {
  Eigen::Vector2d from{0, 0};           ///< first corner
  Eigen::Vector2d to{0, 0};             ///< second corner
  Eigen::Vector2d normal{0, 0};         ///< outward unit normal
  Eigen::Vector2d normal_before{0, 0};  ///< of the edge that ends at `from`
  Eigen::Vector2d normal_after{0, 0};   ///< of the edge that starts at `to`
  double length_px = 0;
  Eigen::Matrix3d cell_H_px = Eigen::Matrix3d::Identity();  ///< pixels to cells: u along the edge, v inwards
  Eigen::Vector3d behind_line{0, 0, 0};  ///< unit line v = 1 cell: signed distance grows outwards
  Eigen::Vector3d beyond_line{0, 0, 0};  ///< unit line v = -1 cell
  double cell_px = 0;                    ///< smallest distance along the edge to either line
  /// Known outward bulge of the edge at place t along it (-1 to 1): (1 - t^2)(b0 + b1 t + b2 t^2) [px].
  Eigen::Vector3d bulge_px{0, 0, 0};

  [[nodiscard]] double bulge_at(double t) const {
    return (1.0 - t * t) * (bulge_px[0] + t * (bulge_px[1] + t * bulge_px[2]));
  }
};

/// Homography of the unit square onto a quad TL, TR, BR, BL (Heckbert, "Fundamentals of texture mapping and
/// image warping", 1989, section 2.2.3).
[[nodiscard]] Eigen::Matrix3d homography_of_unit_square(const Quad& quad);

/// Frames of the four edges; cells = cells along a side. The quad must be convex, clockwise as seen.
[[nodiscard]] std::array<EdgeFrame, 4> edge_frames(const Quad& corners_px, int cells);

/// How far from the edge to look.
struct BandLimits {
  double inside_px = 0;
  double outside_px = 0;
  double corner_margin_px = 0;  ///< keep this far inside both neighbouring edges
  bool cells_matter = false;    ///< whether neighbouring cells blur into the band
  int max_slices = kMaxSlices;  ///< longer edges are sampled more sparsely
};

/// The pixels around one edge, cut into slices: columns where the edge is more horizontal than vertical, rows
/// otherwise. Pixels are taken as they are, never interpolated, so their noise stays independent. Along a
/// slice the distance to the edge grows outwards by `step_px` from pixel to pixel. Slices are kept in blocks
/// of kLanes.
struct Band {
  using Plane = std::array<std::array<Lanes, kMaxDepth>, kMaxBlocks>;

  int slices = 0;
  int blocks = 0;
  int depth = 0;
  int pixels = 0;  ///< with weight > 0
  float step_px = 1;
  bool cells_matter = false;  ///< whether behind, beyond and inside are filled
  bool beyond_known = false;
  bool clipped = false;                 ///< whether a pixel is as dark or as bright as a pixel can be
  std::array<Lanes, kMaxBlocks> along;  ///< place along the edge, -1 at its first corner, +1 at its second
  std::array<Lanes, kMaxBlocks>
      first_px;  ///< signed distance of a slice's first pixel from the edge, bulge included
  std::array<Lanes, kMaxBlocks> behind_px;  ///< how far inside the edge the row behind the border begins
  std::array<Lanes, kMaxBlocks> beyond_px;  ///< how far outside the edge the row beyond the ring begins
  Plane value;                              ///< grey level
  Plane weight;                             ///< 0 or 1
  Plane behind;  ///< share of the outer colour in the row behind, at this place along the edge, blurred
  Plane beyond;  ///< the same beyond the ring outside, less one; 0 where unknown
  Plane inside;  ///< share of the blurred pixel inside both neighbouring edges
};

/// Reads the band around an edge. Pixels outside the image or the limits get weight 0. O(pixels).
void read_band(const ImageView& image, const EdgeFrame& edge, const Surroundings& near,
               const BandLimits& limits, double blur_px, Band& band);

}  // namespace waymark::refinement
