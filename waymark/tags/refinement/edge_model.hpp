#pragma once

#include <array>

#include <Eigen/Core>

#include "waymark/families/family.hpp"
#include "waymark/image/image.hpp"
#include "waymark/tags/refinement/edge_sums.hpp"

namespace waymark::refinement {

/// The compiler chooses the implementation (SSE, NEON or a loop).
using Lanes = Eigen::Array<float, kLanes, 1>;

template <>
[[gnu::always_inline]] inline Lanes load<Lanes>(const float* lanes) {
  return Eigen::Map<const Lanes>(lanes);
}
template <>
[[gnu::always_inline]] inline void store<Lanes>(const Lanes& lanes, float* to) {
  Eigen::Map<Lanes>{to} = lanes;
}

inline constexpr int kMaxCells =
    16;  ///< maximum number of cells along the border square of a tag; AprilTag's families have 3 to 8

/// A row of cells parallel to one border edge, in the order of that edge's corners. Each value is 0 or 1: the
/// share of the colour that lies just outside the border, which is white for most families and black for a
/// reversed border.
using CellRow = std::array<float, kMaxCells>;

/// The print near one border edge. The border itself is one cell wide on either side of the edge.
struct Surroundings {
  int cells = 0;              ///< number of cells along the edge
  CellRow behind{};           ///< the row behind the inner border ring: the outermost data bits
  CellRow beyond{};           ///< the row beyond the ring outside the border, if the family has bits there
  bool beyond_known = false;  ///< if false, that row is not part of the print (margin, wall, ...)
};

using Quad = std::array<Eigen::Vector2d, 4>;

/// Whether corners are finite, in clockwise order, and form triangles of more than half a square pixel.
[[nodiscard]] bool is_convex(const Quad& corners_px);
/// The largest distance between corresponding corners.
[[nodiscard]] double farthest_px(const Quad& a, const Quad& b);

/// The print of a tag. Black and white are exchanged if it is inverted.
struct PrintedTag {
  TagId id;
  bool inverted = false;
  /// Whether nearly all cells of the brighter colour are saturated, so that its level is unknown.
  bool saturated = false;

  /// Whether the border is brighter than the cells next to it.
  [[nodiscard]] bool bright_border() const { return family(id.family).reversed_border != inverted; }
  /// The direction from the edge of the border to its white side: 1 if outwards, -1 if inwards.
  [[nodiscard]] double outwards() const { return bright_border() ? -1.0 : 1.0; }
};

/// The print of a tag with these corners. It is inverted if the mean level of its white bits is below that of
/// its black bits. The id must exist in the family. O(data bits).
[[nodiscard]] PrintedTag printed_tag(const ImageView& image, const TagId& id, const Quad& corners_px);

/// The surroundings of the four edges TL-TR, TR-BR, BR-BL, BL-TL of a tag. The id must exist in the family.
/// O(data bits).
[[nodiscard]] std::array<Surroundings, 4> tag_surroundings(const TagId& id);

inline constexpr int kMaxSlices = 64;  ///< maximum per edge; longer edges are sampled sparsely
inline constexpr int kMaxDepth = 24;   ///< maximum number of pixels per slice
inline constexpr int kMaxBlocks = kMaxSlices / kLanes;

/// One border edge of a quad and the lines parallel to it, in pixels.
struct EdgeFrame {
  Eigen::Vector2d from{0, 0};           ///< first corner
  Eigen::Vector2d to{0, 0};             ///< second corner
  Eigen::Vector2d normal{0, 0};         ///< outward unit normal
  Eigen::Vector2d normal_before{0, 0};  ///< outward normal of the edge that ends at `from`
  Eigen::Vector2d normal_after{0, 0};   ///< outward normal of the edge that starts at `to`
  double length_px = 0;
  Eigen::Matrix3d cell_H_px = Eigen::Matrix3d::Identity();  ///< from px to cells: u along the edge, v inwards
  Eigen::Vector3d behind_line{0, 0, 0};  ///< unit line v = 1 cell; signed distance increases outwards
  Eigen::Vector3d beyond_line{0, 0, 0};  ///< unit line v = -1 cell
  double cell_px = 0;  ///< smallest distance from the edge to either line, measured along the edge
  /// Known outward bulge of the edge at position t along it (-1 to 1): (1 - t^2)(b0 + b1 t + b2 t^2) [px].
  Eigen::Vector3d bulge_px{0, 0, 0};

  [[nodiscard]] double bulge_at(double t) const {
    return (1.0 - t * t) * (bulge_px[0] + t * (bulge_px[1] + t * bulge_px[2]));
  }
};

/// Homography from the unit square to a quad TL, TR, BR, BL (Heckbert, "Fundamentals of texture mapping and
/// image warping", 1989, section 2.2.3).
[[nodiscard]] Eigen::Matrix3d homography_of_unit_square(const Quad& quad);

/// Frames of the four edges; `cells` is the number of cells along each side. The quad must be convex and
/// clockwise in the image.
[[nodiscard]] std::array<EdgeFrame, 4> edge_frames(const Quad& corners_px, int cells);

/// Extent of a band around an edge.
struct BandLimits {
  double inside_px = 0;
  double outside_px = 0;
  double corner_margin_px = 0;  ///< distance to be kept from both neighbouring edges
  bool cells_matter = false;    ///< whether blurred neighbouring cells affect the band
  int max_slices = kMaxSlices;  ///< longer edges are sampled more sparsely
};

/// The pixels around one edge, cut into slices: columns if the edge is more horizontal than vertical, rows
/// otherwise. Pixels are not interpolated, so their noise remains independent. Along a slice, the distance to
/// the edge increases outwards by `step_px` per pixel. Slices are stored in blocks of kLanes.
struct Band {
  using Plane = std::array<std::array<Lanes, kMaxDepth>, kMaxBlocks>;

  int slices = 0;
  int blocks = 0;
  int depth = 0;
  int pixels = 0;  ///< number of pixels with weight > 0
  float step_px = 1;
  bool cells_matter = false;  ///< whether `behind`, `beyond` and `inside` are filled
  bool beyond_known = false;
  bool clipped = false;                 ///< whether any pixel is saturated (dark or bright)
  std::array<Lanes, kMaxBlocks> along;  ///< position along the edge: -1 at its first corner, +1 at its second
  std::array<Lanes, kMaxBlocks>
      first_px;  ///< signed distance of the first pixel of each slice from the edge, including the bulge
  std::array<Lanes, kMaxBlocks> behind_px;  ///< distance from the edge inwards to the row behind the border
  std::array<Lanes, kMaxBlocks> beyond_px;  ///< distance from the edge outwards to the row beyond the ring
  Plane value;                              ///< grey level
  Plane weight;                             ///< 0 or 1
  Plane behind;  ///< share of the outer colour in the row behind the border, blurred, at this position along
                 ///< the edge
  Plane beyond;  ///< the same for the row beyond the outer ring, minus one; 0 if unknown
  Plane inside;  ///< share of the blurred pixel that lies inside both neighbouring edges
};

/// Reads the band around an edge. Pixels outside the image or the limits are given weight 0. O(pixels).
void read_band(const ImageView& image, const EdgeFrame& edge, const Surroundings& near,
               const BandLimits& limits, double blur_px, Band& band);

inline constexpr int kOwn = 4;     ///< parameters specific to one edge
inline constexpr int kCommon = 3;  ///< parameters that are nearly common to the edges of a tag

using EdgeVector = Eigen::Matrix<double, kParameters, 1>;
using EdgeMatrix = Eigen::Matrix<double, kParameters, kParameters>;

/// Least squares about one parameter vector: the sum of w (r - J dx)^2, where J is the derivative of the
/// model.
struct NormalEquations {
  EdgeMatrix information = EdgeMatrix::Zero();  ///< sum of w J^T J
  EdgeVector gradient = EdgeVector::Zero();     ///< sum of w J^T r
  double cost = 0;                              ///< sum of w r^2 [grey level^2]
  double flat_cost = 0;    ///< part of the cost from pixels that hardly depend on the edge position
  double flat_pixels = 0;  ///< the number of those pixels
  /// Sums over the flat pixels for an illumination gradient along the edge, with t from -1 to 1 [grey
  /// level^2].
  double illumination_information = 0;  ///< sum of w (I t)^2, where I is the model
  double illumination_gradient = 0;     ///< sum of w I t r

  /// Number of pixels with weight.
  [[nodiscard]] double pixels() const { return information(kInnerLevel, kInnerLevel); }
};

/// Sum of w r^2 for each slice, in blocks.
using SliceCosts = std::array<Lanes, kMaxBlocks>;

/// Compares a band with the model of a blurred edge and its surroundings,
///
///     I(d) = inner + step f(d) + beyond h(d)
///     z = (d - shift) / blur, where shift is the outward displacement at this position along the edge
///     f = 1 - inside Phi(-z) + behind Phi(-z - behind_px / blur) + beyond Phi(z - beyond_px / blur)
///     h = Phi(z - beyond_px / blur) if the row beyond is not part of the print, otherwise 0
///
/// A saturated pixel contributes only while the model is within the range of grey levels. If the model is
/// beyond that range, the pixel carries no further information (as in Tobin, "Estimation of relationships for
/// limited dependent variables", Econometrica 26, 1958).
///
/// With an illumination gradient along the edge, grey levels are (1 + illumination t) times these, where t
/// runs from -1 to 1.
///
/// Here d is the signed distance from the edge and Phi the normal distribution function; `behind`, `beyond`
/// and `inside` are as in Band. O(pixels).
[[nodiscard]] NormalEquations linearize(const Band& band, const EdgeVector& parameters, double illumination,
                                        SliceCosts& costs, SumEdge sum_edge = fastest_sum_edge());

}  // namespace waymark::refinement
