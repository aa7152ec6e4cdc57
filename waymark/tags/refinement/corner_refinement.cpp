#include "waymark/tags/refinement/corner_refinement.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include <Eigen/Cholesky>

#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement/bent_sheet.hpp"
#include "waymark/tags/refinement/bit_placement.hpp"
#include "waymark/tags/refinement/cell_steps.hpp"
#include "waymark/tags/refinement/curved_border.hpp"
#include "waymark/tags/refinement/inner_bits.hpp"
#include "waymark/tags/refinement/kept_corners.hpp"
#include "waymark/tags/refinement/lens_bends.hpp"
#include "waymark/tags/refinement/tag_fit.hpp"

namespace waymark {
namespace {

using Eigen::Vector2d;
using CornerVector = Eigen::Matrix<double, 8, 1>;
using namespace refinement;  // NOLINT(google-build-using-namespace): the parts of this refinement

constexpr int kMaxPasses = 4;
constexpr int kMaxIterations = 6;
constexpr double kPassTolerancePx = 0.1;   ///< if all corners move less, the image is not read again
constexpr double kFirstTolerancePx = 0.1;  ///< convergence tolerance of the first pass, with a wide band
constexpr double kTolerancePx = 0.01;  ///< convergence tolerance; the next step would be far below the noise

bool usable(const ImageView& image, const TagDetection& detection) {
  if (image.empty() || detection.tag.number < 0) return false;
  if (static_cast<std::size_t>(detection.tag.number) >= family(detection.tag.family).codes.size())
    return false;
  for (const Vector2d& corner : detection.corners_px) {
    if (!corner.allFinite()) return false;
    // Allows a margin of one image size on each side: enough for a tag partly out of view, and far from any
    // overflow of an int or a float.
    if (std::abs(corner.x() - 0.5 * image.width) > 1.5 * image.width) return false;
    if (std::abs(corner.y() - 0.5 * image.height) > 1.5 * image.height) return false;
  }
  return is_convex(detection.corners_px);
}

bool cut_by_border(const ImageView& image, const TagDetection& detection, double border_px) {
  return std::ranges::any_of(detection.corners_px, [&](const Vector2d& corner) {
    return !(corner.x() >= border_px && corner.x() <= image.width - border_px && corner.y() >= border_px &&
             corner.y() <= image.height - border_px);
  });
}

/// Gauss-Newton iteration on the pixels of the current bands; returns `nullopt` if too few are left.
std::optional<TagSolve> iterate(const Priors& priors, bool first_pass, TagBands& tag, TagEstimate& estimate) {
  const double settled_px = first_pass ? kFirstTolerancePx : kTolerancePx;
  std::optional<TagSolve> solve;
  bool covered = true;  // repeated until no more slices are dropped
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    double cost = linearize_all(estimate.edges, estimate.illumination_per_px, tag);
    if (covered && iteration > 0) {
      const DroppedSlices dropped = drop_outliers(tag);
      if (!dropped.enough_left) return std::nullopt;
      covered = dropped.pixels > 0;
      if (covered) cost = linearize_all(estimate.edges, estimate.illumination_per_px, tag);
    }
    double pixels = 0;
    for (const NormalEquations& normal : tag.normals) pixels += normal.pixels();
    constexpr double kQuantisation = 1.0 / 12.0;
    estimate.noise_variance = std::max(kQuantisation, cost / std::max(1.0, pixels - kParametersOfTag));
    if (!first_pass) {
      estimate.illumination_per_px +=
          illumination_information(tag, estimate.illumination_per_px, estimate.noise_variance).step_per_px;
    }
    solve.emplace(tag.normals, priors, estimate);
    const double moved = solve->apply(estimate);
    if (iteration > 0 && !covered && moved < settled_px) break;
  }
  return solve;
}

Eigen::Matrix<double, 8, 1> displacements(const TagEstimate& estimate) {
  Eigen::Matrix<double, 8, 1> both;
  for (std::size_t k = 0; k < 4; ++k)
    both.segment<2>(2 * static_cast<Eigen::Index>(k)) = estimate.edges[k].head<2>();
  return both;
}

/// Whether the sides bulge as no lens bends them, or so much that the curvature may change along them.
bool may_be_bent(const TagEstimate& estimate, const TagBands& tag) {
  constexpr double kMaxBulgePx = 1;
  constexpr double kMaxBesidesLensPx = 0.06;
  std::array<double, 4> bend_px{};
  for (std::size_t k = 0; k < 4; ++k) bend_px[k] = estimate.edges[k][kBend];
  const RadialField field = radial_field(tag.edges, bend_px);
  for (std::size_t k = 0; k < 4; ++k) {
    if (std::abs(bend_px[k]) > kMaxBulgePx) return true;
    if (std::abs(bend_px[k] - bulge_px(field, tag.edges[k])) > kMaxBesidesLensPx) return true;
  }
  return false;
}

double largest_shift(const Quad& from, const Quad& to, const std::array<EdgeFrame, 4>& edges) {
  double largest = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d moved = to[k] - from[k];
    largest = std::max(
        {largest, std::abs(edges[k].normal.dot(moved)), std::abs(edges[(k + 3) % 4].normal.dot(moved))});
  }
  return largest;
}

/// What suggests that the fit of a flat tag is not enough.
struct FitWarnings {
  bool bits_disagree = false;  ///< nearly, with the border
  bool sides_bulge = false;    ///< as those of a bent sheet may
  bool levels_differ = false;  ///< from side to side, because of glare, a shadow or a cover
};

bool sides_differ_in_level(const TagEstimate& estimate) {
  constexpr double kShareOfStep = 0.08;
  const auto spread = [&](Eigen::Index level) {
    double least = estimate.edges[0][level];
    double most = least;
    for (const EdgeVector& x : estimate.edges) {
      least = std::min(least, x[level]);
      most = std::max(most, x[level]);
    }
    return most - least;
  };
  return std::max(spread(kInnerLevel), spread(kStep)) > kShareOfStep * std::abs(estimate.mean[kStep - kOwn]);
}

void start(const RefinementOptions& options, const TagBands& tag, TagEstimate& estimate) {
  const double inner = level_at_rim(tag, false);
  estimate.mean << inner, level_at_rim(tag, true) - inner, std::log(options.blur_px);
  for (EdgeVector& x : estimate.edges) x << EdgeVector::Zero().head<kOwn>(), estimate.mean;
}

/// Moves the corners to the edges predicted by the bits inside the border. If the bits contradict the border
/// (because it is covered or merges with its background), the fit is rejected. If they nearly contradict it,
/// the covariance is scaled by the scale factor of the Particle Data Group ("Review of particle physics",
/// section 5.2.2). The factor is squared, because without squaring it proved too small for white margins of a
/// quarter of a cell.
RefinementOutcome correct(const EdgeCorrection& inner, const TagBands& tag, FitWarnings& warnings,
                          RefinedCorners& result) {
  constexpr double kContradictionSigmas = 4;
  constexpr double kAgreementSigmas = 2.5;
  const bool contradicted = !(inner.worst_sigmas < kContradictionSigmas);
  result.state = contradicted ? CornerState::Unreliable : CornerState::Measured;
  if (contradicted) return RefinementOutcome::PoorFit;
  const Eigen::Matrix<double, 8, 8> J = intersection(tag.edges);
  const Eigen::Matrix<double, 8, 1> moved = J * inner.outwards_px;
  for (std::size_t k = 0; k < 4; ++k)
    result.corners_px[k] += moved.segment<2>(2 * static_cast<Eigen::Index>(k));
  const Eigen::Matrix<double, 8, 8> added = J * inner.covariance_px2 * J.transpose();
  const double apart = std::max(1.0, inner.worst_sigmas / kAgreementSigmas);
  warnings.bits_disagree = apart > 1.0;
  const double scale = apart * apart;
  result.covariance_px2 = scale * scale * (result.covariance_px2 + 0.5 * (added + added.transpose()));
  return RefinementOutcome::Refined;
}

RefinementOutcome fit(const ImageView& image, const PrintedTag& print, const Quad& start_px,
                      const RefinementOptions& options, const CameraModel* camera, FitWarnings& warnings,
                      RefinedCorners& result) {
  // The shares of the outer colour are the same in an inverted print; only the sign of the step differs.
  const std::array<Surroundings, 4> near = tag_surroundings(print.id);
  const int cells = near[0].cells;
  TagBands tag;
  TagEstimate estimate;
  Priors priors;
  priors.blur_px = options.blur_px;
  Quad corners = start_px;
  std::optional<TagSolve> solve;
  double blur_px = options.blur_px;
  bool settled = false;
  for (int pass = 0; pass < kMaxPasses && !settled; ++pass) {
    tag.edges = edge_frames(corners, cells);
    for (const EdgeFrame& edge : tag.edges) {
      if (!(edge.cell_px >= options.min_cell_px)) return RefinementOutcome::TooSmall;
    }
    priors.bend_sigma_px = expect_bends(camera, options.curvature_per_px, tag.edges);
    if (!read_bands(image, near, blur_px, pass == 0, tag)) return RefinementOutcome::TooLittleSeen;
    if (pass == 0) start(options, tag, estimate);
    for (EdgeVector& x : estimate.edges)
      x.head<2>().setZero();  // the corners have already been moved accordingly
    solve = iterate(priors, pass == 0, tag, estimate);
    if (!solve) return RefinementOutcome::TooLittleSeen;
    const Eigen::Matrix<double, 8, 1> moved = intersection(tag.edges) * displacements(estimate);
    if (!moved.allFinite()) return RefinementOutcome::PoorFit;
    for (std::size_t k = 0; k < 4; ++k) corners[k] += moved.segment<2>(2 * static_cast<Eigen::Index>(k));
    if (!is_convex(corners)) return RefinementOutcome::PoorFit;
    if (largest_shift(start_px, corners, tag.edges) > options.max_shift_px) {
      return RefinementOutcome::MovedTooFar;
    }
    blur_px = std::exp(estimate.mean[kLogBlur - kOwn]);
    settled = pass > 0 && displacements(estimate).cwiseAbs().maxCoeff() < kPassTolerancePx;
  }
  if (!settled) return RefinementOutcome::PoorFit;
  tag.lens = camera != nullptr ? lens_field(*camera, tag.edges) : std::nullopt;
  result.corners_px = corners;
  result.blur_px = blur_px;
  result.contrast = estimate.mean[kStep - kOwn];
  result.noise = std::sqrt(estimate.noise_variance);
  result.covariance_px2 = corner_covariance(*solve, estimate, tag, options.model_error_px);
  result.pixels = tag.pixels;
  warnings.sides_bulge = may_be_bent(estimate, tag);
  warnings.levels_differ = sides_differ_in_level(estimate);
  return correct(inner_correction(image, print, tag, estimate), tag, warnings, result);
}

RefinementOutcome judge(const PrintedTag& print, const RefinementOptions& options,
                        const RefinedCorners& result) {
  const double step = print.outwards() * result.contrast;
  if (step < options.min_contrast) return RefinementOutcome::LowContrast;
  if (result.noise > options.max_residual * step) return RefinementOutcome::PoorFit;
  // If sharp edges run along pixel boundaries, their position between the pixels is undetermined.
  if (Eigen::LLT<CornerCovariance>(result.covariance_px2).info() != Eigen::Success)
    return RefinementOutcome::PoorFit;
  const double largest = result.covariance_px2.diagonal().maxCoeff();
  if (!(largest < options.unrefined_sigma_px * options.unrefined_sigma_px)) return RefinementOutcome::PoorFit;
  return RefinementOutcome::Refined;
}

CornerVector as_vector(const Quad& corners) {
  CornerVector all;
  for (std::size_t k = 0; k < 4; ++k) all.segment<2>(2 * static_cast<Eigen::Index>(k)) = corners[k];
  return all;
}

/// Whether the steps between cells place the corners elsewhere. Unlike the fit of the border, they do not
/// depend on the levels of the tag.
bool steps_disagree(const ImageView& image, const PrintedTag& print, const RefinedCorners& refined) {
  constexpr double kTypical = 0.2;  // mean normalised square of a shift; kept corners have large covariances
  const StepPlacement steps = place_by_steps(image, print, refined.corners_px);
  const CornerCovariance covariance_px2 = refined.covariance_px2 + step_covariance(KeptCause::PoorFit, steps);
  const CornerVector shift_px = as_vector(steps.shift_px);
  return shift_px.dot(covariance_px2.llt().solve(shift_px)) > kTypical * static_cast<double>(shift_px.size());
}

/// The corners by the fit of a flat tag's border, if that succeeds and nothing contradicts it.
RefinedCorners by_border(const ImageView& image, const TagDetection& detection, const PrintedTag& print,
                         const RefinementOptions& options, const CameraModel* camera, FitWarnings& warnings) {
  RefinedCorners result;
  if (cut_by_border(image, detection, options.border_px)) {
    result.outcome = RefinementOutcome::CutByBorder;
    return result;
  }
  result.outcome = fit(image, print, detection.corners_px, options, camera, warnings, result);
  if (result.refined()) result.outcome = judge(print, options, result);
  if (result.refined() && warnings.levels_differ && !print.saturated && steps_disagree(image, print, result))
    result.outcome = RefinementOutcome::PoorFit;
  return result;
}

constexpr double kChanceOfOthers = 0.5;

/// If corners may be these or others, their covariance contains the difference.
void include_difference(const Quad& others_px, RefinedCorners& corners) {
  const CornerVector apart = as_vector(others_px) - as_vector(corners.corners_px);
  corners.covariance_px2 += kChanceOfOthers * apart * apart.transpose();
}

/// The same, unless both agree within their covariances.
void include_difference(const RefinedCorners& others, RefinedCorners& corners) {
  constexpr double kAgreement = 2;  // mean normalised square of a coordinate
  const CornerVector apart = as_vector(others.corners_px) - as_vector(corners.corners_px);
  const CornerCovariance both = corners.covariance_px2 + others.covariance_px2;
  if (apart.dot(both.llt().solve(apart)) < kAgreement * static_cast<double>(apart.size())) return;
  include_difference(others.corners_px, corners);
  corners.covariance_px2 += kChanceOfOthers * others.covariance_px2;
}

/// The corners of a bent tag.
RefinedCorners corners_of(const Bend& bend, const Quad& detected_px, const PrintedTag& print,
                          const RefinementOptions& options) {
  constexpr double kWellBent = 8e-4;  // cells^2
  const CurvedBorder& border = bend.border;
  RefinedCorners corners{.outcome = RefinementOutcome::Refined,
                         .corners_px = border.corners_px,
                         .covariance_px2 = border.covariance_px2,
                         .blur_px = options.blur_px,
                         .contrast = print.outwards() * border.contrast,
                         .noise = border.noise_px * border.contrast / options.blur_px,
                         .pixels = border.crossings,
                         .curved = true};
  // A cover over one side explains poor agreement of the bits, too.
  if (bend.if_bent > kWellBent) include_difference(detected_px, corners);
  return corners;
}

/// Whether corners that were placed by the bits are to be used instead of those of the border.
bool better(const RefinedCorners& placed, const RefinedCorners& by_border, const PrintedTag& print,
            const RefinementOptions& options) {
  return judge(print, options, placed) == RefinementOutcome::Refined &&
         (!by_border.refined() || placed.covariance_px2.trace() < by_border.covariance_px2.trace());
}

/// Whether it is worth trying to place the tag by its bits after this outcome.
bool may_place_by_bits(RefinementOutcome outcome) {
  return outcome == RefinementOutcome::TooLittleSeen || outcome == RefinementOutcome::LowContrast ||
         outcome == RefinementOutcome::PoorFit || outcome == RefinementOutcome::MovedTooFar;
}

/// The corners of a tag that could not be refined, with the state and covariance that the cause and the steps
/// between cells imply.
RefinedCorners keep(const ImageView& image, const PrintedTag& print, const Quad& corners_px,
                    const RefinementOptions& options, const RefinedCorners& failed) {
  constexpr double kUsualSigmaPx = 0.5;
  constexpr double kShareOfBent = 0.9;  // of the steps: a bend that explains as many is not a mistake
  const double variance_px2 = options.unrefined_sigma_px * options.unrefined_sigma_px;
  RefinedCorners kept;
  kept.outcome = failed.outcome;
  kept.corners_px = corners_px;
  kept.covariance_px2 = variance_px2 * CornerCovariance::Identity();
  if (kept.outcome == RefinementOutcome::UnusableQuad) return kept;
  const StepPlacement steps = place_by_steps(image, print, corners_px);
  const bool is_suspect =
      failed.state == CornerState::Unreliable || failed.outcome == RefinementOutcome::MovedTooFar;
  const bool is_explained = steps.bent && steps.share > kShareOfBent;
  if (is_suspect && !is_explained && (contradicts(steps, kept.covariance_px2) || !agree(steps)))
    kept.state = CornerState::Unreliable;
  const KeptCorners placed = kept.state == CornerState::Unreliable
                                 ? contradicted_corners(kept.outcome, print, corners_px, steps)
                                 : kept_corners(kept.outcome, print, corners_px, steps);
  kept.corners_px = placed.corners_px;
  kept.covariance_px2 = variance_px2 / (kUsualSigmaPx * kUsualSigmaPx) * placed.covariance_px2;
  return kept;
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
  const bool known = usable(image, detection);
  const PrintedTag print =
      known ? printed_tag(image, detection.tag, detection.corners_px) : PrintedTag{detection.tag};
  FitWarnings warnings;
  RefinedCorners result;
  if (known) result = by_border(image, detection, print, options, camera, warnings);
  std::optional<RefinedCorners> placed;
  if (warnings.bits_disagree || may_place_by_bits(result.outcome)) {
    placed = place_by_bits(image, detection, print, options, camera);
    if (placed && !better(*placed, result, print, options)) placed.reset();
  }
  std::optional<RefinedCorners> curves;
  if (placed || warnings.sides_bulge || may_place_by_bits(result.outcome)) {
    if (const auto bend = find_bend(image, print, detection.corners_px)) {
      curves = corners_of(*bend, detection.corners_px, print, options);
      if (bend->confirmed && judge(print, options, *curves) == RefinementOutcome::Refined) return *curves;
    }
  }
  if (curves && result.refined()) {
    include_difference(*curves, result);
    result.outcome = judge(print, options, result);
  }
  if (placed) {
    if (curves) include_difference(*curves, *placed);
    if (better(*placed, result, print, options)) return *placed;
  }
  if (result.refined()) return result;
  RefinedCorners kept = keep(image, print, detection.corners_px, options, result);
  if (curves) include_difference(*curves, kept);
  return kept;
}

}  // namespace waymark
