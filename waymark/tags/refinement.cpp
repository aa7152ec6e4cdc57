#include "waymark/tags/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>

#include "waymark/samples/corners.hpp"
#include "waymark/tags/tag_fit.hpp"

namespace waymark {
namespace {

using Eigen::Vector2d;
using namespace refinement;

constexpr int kMaxPasses = 4;
// Of a fit to believe, shares of the step; what covers a border pulls harder than noise, and is seen.
constexpr double kMostExcess = 2.5;
constexpr double kSeenSystematic = 0.005;
constexpr double kSeenResidual = 0.01;
constexpr double kMostSystematic = 0.025;
constexpr double kNearPx = 0.5;  ///< corners that moved less than this need no new look at the image

/// Twice the signed area of the smallest triangle of three consecutive corners; > 0 for a convex clockwise
/// quad.
double smallest_triangle(const Quad& c) {
  double smallest = 1e300;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d u = c[(k + 1) % 4] - c[k];
    const Vector2d v = c[(k + 2) % 4] - c[k];
    smallest = std::min(smallest, u.x() * v.y() - u.y() * v.x());
  }
  return smallest;
}

bool usable(const ImageView& image, const TagDetection& detection) {
  if (image.empty() || detection.tag.number < 0) return false;
  if (static_cast<std::size_t>(detection.tag.number) >= family(detection.tag.family).codes.size())
    return false;
  for (const Vector2d& corner : detection.corners_px) {
    if (!corner.allFinite()) return false;
    // One image beyond each side: enough for a tag partly out of view, and far from what an int or a float
    // can hold.
    if (std::abs(corner.x() - 0.5 * image.width) > 1.5 * image.width) return false;
    if (std::abs(corner.y() - 0.5 * image.height) > 1.5 * image.height) return false;
  }
  return smallest_triangle(detection.corners_px) > 1.0;
}

bool cut_by_border(const ImageView& image, const TagDetection& detection, double border_px) {
  return std::ranges::any_of(detection.corners_px, [&](const Vector2d& corner) {
    return !(corner.x() >= border_px && corner.x() <= image.width - border_px && corner.y() >= border_px &&
             corner.y() <= image.height - border_px);
  });
}

double largest_shift(const Quad& from, const Quad& to) {
  double largest = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d along = (to[(k + 1) % 4] - to[k]).normalized();
    const Vector2d normal(along.y(), -along.x());
    largest = std::max({largest, std::abs(normal.dot(to[k] - from[k])),
                        std::abs(normal.dot(to[(k + 1) % 4] - from[(k + 1) % 4]))});
  }
  return largest;
}

RefinementOutcome fit_pattern(const ImageView& image, const TagDetection& detection,
                              const RefinementOptions& options, const CameraModel* camera,
                              RefinedCorners& result) {
  TagFit fit;
  start_fit(detection, options, camera, fit);
  Quad corners = detection.corners_px;
  if (!(smallest_cell_px(corners, fit.pattern.pattern.cells) >= options.min_cell_px)) {
    return RefinementOutcome::TooSmall;
  }
  bool settled = false;
  for (int pass = 0; pass < kMaxPasses && !settled; ++pass) {
    const Look seen = look(image, options, corners, pass == 0, fit);
    if (!seen.usable) return RefinementOutcome::TooLittleSeen;
    const Quad before = corners;
    corners = corners_of(fit);
    if (!std::ranges::all_of(corners, [](const Vector2d& corner) { return corner.allFinite(); }) ||
        smallest_triangle(corners) < 1.0) {
      return RefinementOutcome::PoorFit;
    }
    if (largest_shift(detection.corners_px, corners) > options.max_shift_px) {
      return RefinementOutcome::MovedTooFar;
    }
    settled = seen.settled && largest_shift(before, corners) < std::min(kNearPx, seen.reach_px);
  }
  if (!settled) return RefinementOutcome::PoorFit;
  const Certainty certainty = certainty_of(fit, options.model_error_px);
  const bool pulled = certainty.excess > kMostExcess && certainty.residual > kSeenResidual;
  if (certainty.systematic > (pulled ? kSeenSystematic : kMostSystematic)) return RefinementOutcome::PoorFit;
  result.corners_px = corners;
  result.blur_px = std::exp(fit.pattern.x[kLogBlur]);
  result.contrast = (fit.pattern.pattern.white_at(-1, 0) > 0.5F ? 1 : -1) * fit.pattern.x[kStepPlane];
  result.noise = std::sqrt(residual_variance(fit.pattern));
  result.pixels = fit.pattern.pixels.pixels;
  result.covariance_px2 = certainty.covariance_px2;
  return RefinementOutcome::Refined;
}

/// Cells by which the detector's corners may be off, standard deviation, where a fit says no more than that
/// something is wrong: what covers or lights a part of a tag moves its corners in proportion to its size.
double doubted_cells(RefinementOutcome outcome) {
  switch (outcome) {
    case RefinementOutcome::CutByBorder:
      return 1;
    case RefinementOutcome::MovedTooFar:
    case RefinementOutcome::TooLittleSeen:
      return 0.3;
    case RefinementOutcome::PoorFit:
      return 0.1;
    default:
      return 0;
  }
}

RefinementOutcome judge(const TagDetection& detection, const RefinementOptions& options,
                        const RefinedCorners& result) {
  const double step = family(detection.tag.family).reversed_border ? -result.contrast : result.contrast;
  if (step < options.min_contrast) return RefinementOutcome::LowContrast;
  if (result.noise > options.max_residual * step) return RefinementOutcome::PoorFit;
  // Edges without any blur, along the borders of pixels, leave their place between the pixels open.
  if (Eigen::LLT<CornerCovariance>(result.covariance_px2).info() != Eigen::Success)
    return RefinementOutcome::PoorFit;
  const double largest = result.covariance_px2.diagonal().maxCoeff();
  if (!(largest < options.unrefined_sigma_px * options.unrefined_sigma_px)) return RefinementOutcome::PoorFit;
  return RefinementOutcome::Refined;
}

}  // namespace

std::string_view to_string(RefinementOutcome outcome) {
  switch (outcome) {
    case RefinementOutcome::Refined:
      return "refined";
    case RefinementOutcome::UnusableQuad:
      return "unusable_quad";
    case RefinementOutcome::TooSmall:
      return "too_small";
    case RefinementOutcome::CutByBorder:
      return "cut_by_border";
    case RefinementOutcome::TooLittleSeen:
      return "too_little_seen";
    case RefinementOutcome::LowContrast:
      return "low_contrast";
    case RefinementOutcome::PoorFit:
      return "poor_fit";
    case RefinementOutcome::MovedTooFar:
      return "moved_too_far";
  }
  return "unknown";
}

RefinedCorners refine_corners(const ImageView& image, const TagDetection& detection,
                              const RefinementOptions& options, const CameraModel* camera) {
  RefinedCorners result;
  double unrefined_sigma_px = options.unrefined_sigma_px;
  const bool known = usable(image, detection);
  const double cell_px =
      known ? mean_side_px(detection.corners_px) / family(detection.tag.family).width_at_border : 0.0;
  if (known && cut_by_border(image, detection, options.border_px)) {
    result.outcome = RefinementOutcome::CutByBorder;
  } else if (known) {
    result.outcome = fit_pattern(image, detection, options, camera, result);
  }
  if (result.refined()) result.outcome = judge(detection, options, result);
  if (result.refined()) return result;
  if (known) unrefined_sigma_px = std::max(unrefined_sigma_px, doubted_cells(result.outcome) * cell_px);
  RefinedCorners kept;
  kept.outcome = result.outcome;
  kept.corners_px = detection.corners_px;
  kept.covariance_px2 = unrefined_sigma_px * unrefined_sigma_px * CornerCovariance::Identity();
  return kept;
}

}  // namespace waymark
