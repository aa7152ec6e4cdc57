#include "waymark/tags/tag_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace waymark::refinement {
namespace {

constexpr int kMostNewtonSteps = 8;  ///< of Gauss-Newton with the pixels of one look
/// Share of the squared residuals that the next step may take away: the corners may rest long before the blur
/// does, and what is left of it would be taken for noise.
constexpr double kSettledGain = 0.02;

/// Clusters whose residual is out of proportion to that of most others count less, or not at all: something
/// covers or lights the tag there. Returns the share of the pixels that is left.
double weigh_clusters(double tolerance, PatternFit& fit) {
  std::array<float, static_cast<std::size_t>(TagPixels::kMostBlocks) * kLanes> misfits;
  std::size_t known = 0;
  const std::size_t clusters = static_cast<std::size_t>(fit.pixels.blocks) * kLanes;
  const auto misfit = [&](std::size_t c) {
    const BlockSums& block = fit.blocks[c / kLanes];
    return block.cost[c % kLanes] / std::max(1.0F, block.pixels[c % kLanes]);
  };
  const auto pixels_of = [&](std::size_t c) { return fit.blocks[c / kLanes].pixels[c % kLanes]; };
  for (std::size_t c = 0; c < clusters; ++c) {
    if (pixels_of(c) >= 2) misfits[known++] = misfit(c);
  }
  if (known == 0) return 0;
  const auto middle = misfits.begin() + static_cast<std::ptrdiff_t>(known / 2);
  std::nth_element(misfits.begin(), middle, misfits.begin() + static_cast<std::ptrdiff_t>(known));
  const float usual = static_cast<float>(tolerance) * (*middle + 0.25F);
  constexpr float kOutOfProportion = 6.0F;
  float pixels = 0;
  float left = 0;
  for (std::size_t c = 0; c < clusters; ++c) {
    const float of = misfit(c);
    float& weight = fit.pixels.block[c / kLanes].cluster_weight[c % kLanes];
    weight = of <= usual ? 1.0F : of > kOutOfProportion * usual ? 0.0F : usual / of;
    pixels += pixels_of(c);
    left += weight * pixels_of(c);
  }
  return static_cast<double>(left) / std::max(1.0, static_cast<double>(pixels));
}

constexpr double kLeastHalo = -0.6;
constexpr double kMostHalo = 1.5;

/// The step of Gauss-Newton; along the limit of the halo where it would go beyond, and with the halo as it is
/// where, at the `start`, so long a step says only that the blur is far off.
TagVector newton_step(const TagVector& gradient, bool start, const TagFit& fit) {
  constexpr double kLongTails = -0.7;
  TagVector step = fit.solver.solve(gradient);
  const double halo = fit.pattern.x[kHalo];
  if ((halo <= kLeastHalo && step[kHalo] < 0) || (halo >= kMostHalo && step[kHalo] > 0) ||
      (start && step[kHalo] < kLongTails)) {
    const TagVector by_halo = fit.solver.solve(TagVector::Unit(kHalo));
    step -= step[kHalo] / by_halo[kHalo] * by_halo;
    step[kHalo] = 0;
  }
  return step;
}

/// Moves the estimate, not further than the model is near linear; what has become of the step.
TagVector move(const TagVector& step, PatternFit& fit) {
  TagVector& x = fit.x;
  const TagVector before = x;
  constexpr double kLongestPx = 1.0;
  constexpr double kLargestLogBlur = 0.5;
  constexpr double kLargestHalo = 0.4;
  constexpr double kLargestGrowth = 1.0;
  const auto within = [](double value, double limit) { return limit / std::max(std::abs(value), limit); };
  const double moved = (corners_by_parameters(fit) * step).cwiseAbs().maxCoeff() * fit.pixels.unit_px;
  double share = std::min({within(moved, kLongestPx), within(step[kGrowth], kLargestGrowth),
                           within(step[kLogBlur], kLargestLogBlur), within(step[kHalo], kLargestHalo)});
  const double to_limit = (step[kHalo] < 0 ? kLeastHalo : kMostHalo) - x[kHalo];
  if (std::abs(share * step[kHalo]) > std::abs(to_limit)) share = to_limit / step[kHalo];
  x += share * step;
  // Narrower than a pixel's own box or wider than the tag means lost; stay where the model makes sense.
  x[kLogBlur] = std::clamp(x[kLogBlur], std::log(0.25), std::log(4.0));
  x[kGrowth] = std::clamp(x[kGrowth], -2.5, 2.5);
  x[kHalo] = std::clamp(x[kHalo], kLeastHalo, kMostHalo);
  constexpr double kMostStretch = 0.9;
  x.segment<2>(kStretch) *= within(x.segment<2>(kStretch).norm(), kMostStretch);
  return x - before;
}

/// Whether a step is so long that the derivatives are others after it.
bool far(const TagVector& by, double moved_px, const PatternFit& fit) {
  constexpr double kNearPx = 0.15;
  return moved_px > kNearPx || std::abs(by[kLogBlur]) > 0.05 || std::abs(by[kGrowth]) > 0.1 ||
         std::abs(by[kHalo]) > 0.1 || by.segment<2>(kStretch).norm() > 0.1 ||
         std::abs(by[kStepPlane]) > 0.1 * std::abs(fit.x[kStepPlane]);
}

/// A step of Gauss-Newton, and what it promised. Blur and halo do much the same to a picture: steps along
/// both are long and may go too far, again and again.
struct LastStep {
  TagVector by = TagVector::Zero();
  double variance = 0;  ///< of the residuals before
  double gain = 0;      ///< share of it that the step should have taken away
  int halved = 0;

  [[nodiscard]] bool overshot(double variance_now) const {
    constexpr double kWorthLooking = 0.1;
    constexpr int kMostHalvings = 3;
    return gain > kWorthLooking && halved < kMostHalvings && variance_now > (1 - 0.25 * gain) * variance;
  }
  void halve(PatternFit& fit) {
    by *= 0.5;
    fit.x -= by;
    gain *= 0.75;
    ++halved;
  }
};

/// The normal matrix at the estimate, into the solver; false where it is not positive.
bool develop(bool saturated, TagFit& fit) {
  // Saturated white looks like growth until its level is found to lie beyond the scale.
  fit.pattern.priors.growth = saturated ? 0.1 : 1.0;
  set_information(fit.pattern);
  fit.solver.compute(fit.pattern.information);
  return fit.solver.info() == Eigen::Success;
}

}  // namespace

Look iterate(bool found, TagFit& fit) {
  constexpr double kLeastShare = 0.7;
  constexpr double kSameShare = 0.01;
  constexpr int kSaturatedSteps = 4;
  PatternFit& pattern = fit.pattern;
  Look look;
  bool anew = true;
  double share = 1;
  LastStep last;
  for (int step = 0; step < kMostNewtonSteps; ++step) {
    measure(anew, pattern);
    if (last.overshot(residual_variance(pattern))) {
      last.halve(pattern);
      anew = true;
      continue;
    }
    const bool saturated = !found && step < kSaturatedSteps && pattern.pixels.clipped;
    if (anew && !develop(saturated, fit)) return look;
    const TagVector gradient = gradient_of(pattern);
    const TagVector by = newton_step(gradient, !found && step < 2, fit);
    if (!by.allFinite()) return look;
    const TagVector moved = move(by, pattern);
    look.moved_px = (corners_by_parameters(pattern) * moved).cwiseAbs().maxCoeff() * pattern.pixels.unit_px;
    last = {.by = moved,
            .variance = residual_variance(pattern),
            .gain = gradient.dot(moved) / std::max(1.0, static_cast<double>(pattern.sums.pixels))};
    const bool near = found || step > 0;
    const double left = weigh_clusters(near ? 6.0 : 20.0, pattern);
    if (left < kLeastShare) return look;
    const bool same = near && std::abs(left - share) < kSameShare;
    share = left;
    if (look.moved_px < kSettledPx && last.gain < kSettledGain && same) break;
    anew = !same || far(moved, look.moved_px, pattern);
  }
  look.usable = true;
  return look;
}

}  // namespace waymark::refinement
