#include "waymark/tags/refinement/bit_placement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "waymark/families/family.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement/inner_bits.hpp"
#include "waymark/tags/refinement/inner_pixels.hpp"
#include "waymark/tags/refinement/lens_bends.hpp"
#include "waymark/tags/refinement/tag_fit.hpp"

namespace waymark::refinement {
namespace {

/// Mean grey level of the cells of one colour.
struct Level {
  double sum = 0;
  int count = 0;
  [[nodiscard]] double mean() const { return sum / std::max(1, count); }
};

/// Mean levels of black and of white; each pixel is assigned to the cell that contains it.
std::array<Level, 2> levels(const InnerPixels& pixels) {
  std::array<Level, 2> both;
  for (int i = 0; i < pixels.count; ++i) {
    const InnerBlock& block = pixels.block[static_cast<std::size_t>(i / kLanes)];
    const int lane = i % kLanes;
    const std::size_t column = block.past_px[0][1][lane] < 0 ? 1 : 2;
    const std::size_t row = block.past_px[1][1][lane] < 0 ? 1 : 2;
    Level& level = both[block.white[row][column][lane] > 0.5F ? 1 : 0];
    level.sum += static_cast<double>(block.value[lane]);
    ++level.count;
  }
  return both;
}

/// Derivatives of the outward displacements (kFrom, kTo) of the four edges [px] with respect to the unknowns.
/// The edges are the lines s = +-1 and t = +-1; they end where the other coordinate is -1 and 1.
EdgesByInner edges_by_place(const InnerVector& x, double outwards) {
  EdgesByInner J = edges_by_growth(x, outwards);
  for (std::size_t k = 0; k < 4; ++k) {
    const bool across_s = k % 2 == 1;               // edges 1 and 3 are lines of constant s
    const double side = k == 1 || k == 2 ? 1 : -1;  // side of the tag on which the edge lies
    const double blur_px = std::exp(x[across_s ? kBlurS : kBlurT]);
    const int axis = across_s ? 0 : 1;
    for (const int end : {kFrom, kTo}) {
      const double beside =
          (k < 2) == (end == kTo)
              ? 1
              : -1;  // edges 0 and 1 run along s and t, edges 2 and 3 in the opposite directions
      const auto row = static_cast<Eigen::Index>(2 * k) + end;
      J(row, kShiftS + axis) = side * blur_px;
      J(row, kStretchS + axis) = blur_px;
      J(row, kShearS + axis) = side * beside * blur_px;
      J(row, kTaperS + axis) = beside * blur_px;
      J(row, kSqueezeS + axis) = J(row, kBendS + axis) = side * blur_px;
    }
  }
  return J;
}

/// How a tag is placed: whether its white may be far beyond the range of the image, and the prior standard
/// deviation of its corners.
struct Placing {
  bool saturated = false;
  double place_px = 0.7;
};

/// The level of the darkest pixel: that of black, if white spreads over most of the black cells.
double darkest(const InnerPixels& pixels) {
  double least = 255;
  for (int i = 0; i < pixels.count; ++i)
    least = std::min(
        least, static_cast<double>(pixels.block[static_cast<std::size_t>(i / kLanes)].value[i % kLanes]));
  return least;
}

/// The prior of the levels, and of the place relative to the current corners.
InnerPrior prior_of(const InnerPixels& pixels, const std::array<Level, 2>& level,
                    const std::array<double, 4>& bend_px, const RefinementOptions& options,
                    const Placing& placing) {
  const InnerSigmas sigmas{.level = 0.3,
                           .slope = 0.05,
                           .log_blur = placing.saturated ? 0.6 : 0.4,
                           .place_blurs = placing.place_px / options.blur_px,
                           .bend_blurs = std::ranges::max(bend_px) / options.blur_px};
  const double black = placing.saturated ? darkest(pixels) : level[0].mean();
  const double step = level[1].mean() - black;
  return placing.saturated ? saturated_prior(black, step, std::log(options.blur_px), sigmas)
                           : inner_prior(black, step, std::log(options.blur_px), sigmas);
}

/// The fit to the bits for one set of corners.
struct Look {
  InnerEstimate estimate;
  double variance = 0;       ///< variance of a pixel [grey level^2]
  Matrix8 corners_by_edges;  ///< derivatives of the corners with respect to the edges
};

std::optional<Look> look_at(const ImageView& image, const TagDetection& at, const PrintedTag& print,
                            const RefinementOptions& options, const CameraModel* camera,
                            const Placing& placing, const std::optional<Look>& before, InnerPixels& pixels) {
  const Family& printed = family(at.tag.family);
  TagBands tag;
  tag.edges = edge_frames(at.corners_px, printed.width_at_border);
  for (const EdgeFrame& edge : tag.edges)
    if (!(edge.cell_px >= options.min_cell_px)) return std::nullopt;
  const std::array<double, 4> bend_px = expect_bends(camera, options.curvature_per_px, tag.edges);
  tag.lens = camera != nullptr ? lens_field(*camera, tag.edges) : std::nullopt;
  TagEstimate
      even;  // edges curve only as the camera model predicts; slopes of the levels model uneven illumination
  for (EdgeVector& edge : even.edges) edge.setZero();
  pixels.skew_matters = placing.saturated;
  read_inner_pixels(image, print, tag, even, InnerPixels::kPlacementPixels, pixels);
  const std::array<Level, 2> level = levels(pixels);
  if (level[0].count < kInnerUnknowns || level[1].count < kInnerUnknowns) return std::nullopt;
  const double step = level[1].mean() - level[0].mean();
  if (step < options.min_contrast) return std::nullopt;
  const InnerPrior prior = prior_of(pixels, level, bend_px, options, placing);
  // The levels of saturated white take many iterations, so they continue from the last corners.
  InnerVector start = prior.mean;
  if (placing.saturated && before) start.head<kShiftS>() = before->estimate.mean.head<kShiftS>();
  const InnerFit fit = fit_inner<kInnerUnknowns>(pixels, prior, start, 1.0, print.outwards());
  if (!fit.estimate.mean.allFinite()) return std::nullopt;
  return Look{averaged<kInnerUnknowns>(fit, prior), fit.variance, intersection(tag.edges)};
}

/// The covariance of corners that were placed by the bits.
Matrix8 covariance_of(const Look& look, const EdgesByInner& J) {
  constexpr double kModelPx = 0.02;  // error of the print and of the unknown curvature
  Matrix8 edges = edge_covariance(J, look.estimate.covariance);
  edges.diagonal().array() += kModelPx * kModelPx;
  const Matrix8 corners = (look.corners_by_edges * edges).lazyProduct(look.corners_by_edges.transpose());
  return 0.5 * (corners + corners.transpose());
}

}  // namespace

namespace {

std::optional<RefinedCorners> place(const ImageView& image, const TagDetection& detection,
                                    const PrintedTag& print, const RefinementOptions& options,
                                    const CameraModel* camera, const Placing& placing) {
  constexpr int kMaxPasses = 6;
  constexpr double kMaxResidual = 0.04;   // relative to the step; exceeded if gloss covers bits too
  constexpr double kMaxShiftCells = 0.4;  // beyond half a cell, the wrong bits would be read
  constexpr double kSpreadPx = 1.5;       // by which saturated white covers the border
  constexpr double kRange = 255;
  const double outwards = print.outwards();
  // Includes the border: three rows of three bits are too few for this number of unknowns.
  constexpr int kMinCells = 6;
  if (family(detection.tag.family).width_at_border < kMinCells) return std::nullopt;
  const double cell_px = mean_side_px(detection.corners_px) / family(detection.tag.family).width_at_border;
  const double farthest =
      std::max(options.max_shift_px, kMaxShiftCells * cell_px) + (placing.saturated ? kSpreadPx : 0.0);
  InnerPixels pixels;
  TagDetection at = detection;
  std::optional<Look> look;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    look = look_at(image, at, print, options, camera, placing, look, pixels);
    if (!look) return std::nullopt;
    const double step = placing.saturated
                            ? std::min(look->estimate.mean[kWhite], kRange - look->estimate.mean[kBlack])
                            : look->estimate.mean[kWhite];
    const double residual = std::sqrt(look->variance) / step;
    const EdgesByInner J = edges_by_place(look->estimate.mean, outwards);
    const Eigen::Matrix<double, 8, 1> moved = look->corners_by_edges * (J * look->estimate.mean);
    if (!moved.allFinite()) return std::nullopt;
    for (std::size_t k = 0; k < 4; ++k)
      at.corners_px[k] += moved.segment<2>(2 * static_cast<Eigen::Index>(k));
    if (farthest_px(detection.corners_px, at.corners_px) > farthest) return std::nullopt;
    const Matrix8 covariance = covariance_of(*look, J);
    // For a large tag, each iteration samples different pixels, so the corners converge only to within their
    // standard deviation.
    if ((moved.array().square() > covariance.diagonal().array()).any()) continue;
    if (residual > kMaxResidual) return std::nullopt;
    return RefinedCorners{.outcome = RefinementOutcome::Refined,
                          .corners_px = at.corners_px,
                          .covariance_px2 = covariance,
                          .blur_px = mean_blur_px(look->estimate.mean),
                          .contrast = outwards * step,
                          .noise = std::sqrt(look->variance),
                          .pixels = pixels.count,
                          .by_bits = true};
  }
  return std::nullopt;
}

}  // namespace

std::optional<RefinedCorners> place_by_bits(const ImageView& image, const TagDetection& detection,
                                            const PrintedTag& print, const RefinementOptions& options,
                                            const CameraModel* camera) {
  if (print.saturated) {
    constexpr double kPlacePx = 1.5;
    const auto placed =
        place(image, detection, print, options, camera, {.saturated = true, .place_px = kPlacePx});
    if (placed) return placed;
  }
  return place(image, detection, print, options, camera, {});
}

}  // namespace waymark::refinement
