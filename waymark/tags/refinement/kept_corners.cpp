#include "waymark/tags/refinement/kept_corners.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace waymark::refinement {
namespace {

/// The covariance of a corner is factor * exp(hidden * (1 - share)) times that of the steps, plus the squares
/// of floor_px and of shift times its shift.
struct KeptWeights {
  double factor = 1;
  double hidden = 0;
  double floor_px = 0;
  double shift = 0;
};

/// Printed by tools/learn_kept_corners.py.
constexpr std::array<KeptWeights, kKeptCauses> kKeptWeights = {{
    {0.19, 14, 0.18, 0.99},   // too small, 295 tags
    {1.2, 3.2, 0.023, 0.19},  // low contrast, 107 tags
    {13, 4.4, 0.023, 0.42},   // poor fit, 801 tags
    {2.4, 12, 0.01, 0.4},     // moved too far, 855 tags
    {2.1, 17, 0.018, 0.041},  // bent, 101 tags
}};

/// Adds a variance to both coordinates of each corner.
void add_squared_shift(const StepPlacement& steps, double weight, CornerCovariance& covariance_px2) {
  for (std::size_t k = 0; k < 4; ++k) {
    const auto at = 2 * static_cast<Eigen::Index>(k);
    covariance_px2.diagonal().segment<2>(at).array() += weight * steps.shift_px[k].squaredNorm();
  }
}

KeptCorners in_place(const Quad& corners_px, double sigma_px) {
  return {corners_px, sigma_px * sigma_px * CornerCovariance::Identity()};
}

double cell_of(const PrintedTag& print, const Quad& corners_px) {
  return mean_side_px(corners_px) / family(print.id.family).width_at_border;
}

}  // namespace

KeptCause kept_cause(RefinementOutcome outcome, const StepPlacement& steps) {
  if (outcome == RefinementOutcome::TooSmall) return KeptCause::TooSmall;
  if (steps.bent) return KeptCause::Bent;
  if (outcome == RefinementOutcome::LowContrast) return KeptCause::LowContrast;
  return outcome == RefinementOutcome::MovedTooFar ? KeptCause::MovedTooFar : KeptCause::PoorFit;
}

CornerCovariance step_covariance(KeptCause cause, const StepPlacement& steps) {
  const KeptWeights& weights = kKeptWeights[static_cast<std::size_t>(cause)];
  const double factor = weights.factor * std::exp(weights.hidden * (1 - std::min(1.0, steps.share)));
  CornerCovariance covariance = factor * 0.5 * (steps.covariance_px2 + steps.covariance_px2.transpose());
  covariance.diagonal().array() += weights.floor_px * weights.floor_px;
  add_squared_shift(steps, weights.shift * weights.shift, covariance);
  return covariance;
}

KeptCorners kept_corners(RefinementOutcome outcome, const PrintedTag& print, const Quad& corners_px,
                         const StepPlacement& steps) {
  constexpr double kSaturatedSigmaPx = 0.3;
  constexpr double kUnseenSigmaPx = 0.5;
  // A cell of the border may be missing beyond that of the image, and the steps may be those of other cells.
  if (outcome == RefinementOutcome::CutByBorder)
    return in_place(corners_px, std::max(kUnseenSigmaPx, cell_of(print, corners_px)));
  if (print.saturated) return in_place(corners_px, kSaturatedSigmaPx);
  KeptCorners kept{corners_px, step_covariance(kept_cause(outcome, steps), steps), true};
  for (std::size_t k = 0; k < 4; ++k) kept.corners_px[k] += steps.shift_px[k];
  if (!enough_steps(steps) || !is_convex(kept.corners_px) || !kept.covariance_px2.allFinite())
    return in_place(corners_px, kUnseenSigmaPx);
  return kept;
}

KeptCorners contradicted_corners(RefinementOutcome outcome, const PrintedTag& print, const Quad& corners_px,
                                 const StepPlacement& steps) {
  KeptCorners kept = kept_corners(outcome, print, corners_px, steps);
  if (!kept.by_steps) return kept;
  kept.corners_px = corners_px;
  kept.by_steps = false;
  constexpr double kPerCoordinate = 0.5;
  add_squared_shift(steps, kPerCoordinate, kept.covariance_px2);
  return kept;
}

}  // namespace waymark::refinement
