#include "waymark/tags/inner_correction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "waymark/tags/inner_bits.hpp"
#include "waymark/tags/inner_fit.hpp"

namespace waymark::refinement {
namespace {

constexpr std::array kSlopes = {kBlackS, kBlackT, kWhiteS, kWhiteT};

/// Levels and blur are nearly those at the border; the pattern lies where the border says.
InnerPrior prior_of(const TagEstimate& estimate, bool reversed) {
  const double step = std::abs(estimate.mean[kStep - kOwn]);
  const double black = estimate.mean[kInnerLevel - kOwn] - (reversed ? step : 0);
  return inner_prior(black, step, estimate.mean[kLogBlur - kOwn], {});
}

/// How the unknowns move (kFrom, kTo) of the four edges outwards.
EdgesByInner edges_by_unknowns(const InnerVector& x, double outwards) {
  EdgesByInner J = edges_by_growth(x, outwards);
  constexpr std::array<double, 4> kDirection = {1, 1, -1, -1};  // of the edges along s, t
  for (int k = 0; k < 4; ++k) {
    const int from = 2 * k + kFrom;
    const int to = 2 * k + kTo;
    const double turn = kDirection[static_cast<std::size_t>(k)] * px_per_level(x, outwards);
    J(to, k % 2 == 0 ? kBlackS : kBlackT) = turn;
    J(from, k % 2 == 0 ? kBlackS : kBlackT) = -turn;
    J(to, k % 2 == 0 ? kWhiteS : kWhiteT) = 0.5 * turn;
    J(from, k % 2 == 0 ? kWhiteS : kWhiteT) = -0.5 * turn;
  }
  return J;
}

/// How far the border edges lie from where the bits alone would have them, in standard deviations of the
/// difference: the largest of the four.
double contradiction(const InnerFit& fit, const InnerPrior& prior) {
  const double floor_px =
      std::hypot(0.03, growth_doubt_px(fit.belief.mean));  // print, bends that are not known
  InnerVector precision = prior.precision();
  for (const InnerUnknown free : {kShiftS, kShiftT, kStretchS, kStretchT}) precision[free] = 1.0;
  for (const InnerUnknown slope : kSlopes) precision[slope] /= 25;
  const InnerBelief free = gauss_newton<kUnknownsOnBorder>(fit.sums, fit.variance, prior, precision, fit.at);
  const double blur_px = mean_blur_px(fit.belief.mean);
  double worst = 0;
  for (const double side : {-1.0, 1.0}) {
    for (const auto& [shift, stretch] : {std::pair(kShiftS, kStretchS), std::pair(kShiftT, kStretchT)}) {
      const double off_px = blur_px * (free.mean[shift] + side * free.mean[stretch]);
      const double variance = free.covariance(shift, shift) + free.covariance(stretch, stretch) +
                              2 * side * free.covariance(shift, stretch);
      worst =
          std::max(worst, std::abs(off_px) / std::sqrt(blur_px * blur_px * variance + floor_px * floor_px));
    }
  }
  return worst;
}

}  // namespace

EdgeCorrection inner_correction(const ImageView& image, const TagId& id, const TagBands& tag,
                                const TagEstimate& estimate) {
  const bool reversed = family(id.family).reversed_border;
  const double outwards = reversed ? -1.0 : 1.0;
  InnerPixels pixels;
  read_inner_pixels(image, id, tag, estimate, InnerPixels::kFew, pixels);
  const InnerPrior prior = prior_of(estimate, reversed);
  const InnerFit all = fit_inner<kUnknownsOnBorder>(pixels, prior, estimate.noise_variance, outwards);
  EdgeCorrection correction;
  if (!all.belief.mean.allFinite()) return correction;
  correction.worst_sigmas = contradiction(all, prior);
  const InnerBelief belief = averaged(all, prior);
  const EdgesByInner J = edges_by_unknowns(belief.mean, outwards);
  correction.outwards_px = J * belief.mean;
  correction.covariance_px2 = J * belief.covariance * J.transpose();
  return correction;
}

}  // namespace waymark::refinement
