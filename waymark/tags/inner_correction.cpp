#include "waymark/tags/inner_correction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "waymark/tags/inner_bits.hpp"
#include "waymark/tags/inner_model.hpp"

namespace waymark::refinement {
namespace {

constexpr std::array kSlopes = {kBlackS, kBlackT, kWhiteS, kWhiteT};

/// What is assumed before looking inside the border.
struct Prior {
  InnerVector mean;
  InnerVector sigma;

  [[nodiscard]] InnerVector precision() const { return sigma.array().square().inverse(); }
};

/// Levels and blur are nearly those at the border; the pattern lies where the border says.
Prior prior_of(const TagEstimate& estimate, bool reversed) {
  constexpr double kLevel = 0.05;  // share of the step
  constexpr double kSlope = 0.01;  // share of the step
  constexpr double kGrowthBlurs = 0.25;
  constexpr double kBlurDoubt = 0.1;  // of its ln
  constexpr double kPlaceBlurs = 0.03;
  const double step = std::abs(estimate.mean[kStep - kOwn]);
  const double black = estimate.mean[kInnerLevel - kOwn] - (reversed ? step : 0);
  const double log_blur = estimate.mean[kLogBlur - kOwn];
  Prior prior;
  prior.mean << black, 0, 0, step, 0, 0, 0, log_blur, log_blur, 0, 0, 0, 0;
  prior.sigma << kLevel * step, kSlope * step, kSlope * step, kLevel * step, kSlope * step, kSlope * step,
      kGrowthBlurs, kBlurDoubt, kBlurDoubt, kPlaceBlurs, kPlaceBlurs, kPlaceBlurs, kPlaceBlurs;
  return prior;
}

/// Estimate of the unknowns with its covariance.
struct Belief {
  InnerVector mean;
  InnerMatrix covariance;
};

Belief gauss_newton(const InnerSums& sums, double variance, const Prior& prior, const InnerVector& precision,
                    const InnerVector& x) {
  InnerMatrix information = sums.information / variance;
  information.diagonal() += precision;
  const InnerMatrix covariance = information.llt().solve(InnerMatrix::Identity());
  return {x + covariance * (sums.gradient / variance + precision.cwiseProduct(prior.mean - x)), covariance};
}

/// With the variance of a pixel [grey level^2], and the last sums and where they were taken.
struct Fit {
  Belief belief;
  double variance = 0;
  InnerSums sums;
  InnerVector at;
};

Fit fit(const InnerPixels& pixels, const Prior& prior, double noise_variance, double outwards) {
  constexpr int kMaxIterations = 3;
  constexpr int kMoreIterations = 8;  // of a growth that is large: an overexposed print
  constexpr double kLargeGrowth = 0.3;
  constexpr double kMostGrowth = 2.5;
  constexpr double kSettledBlurs = 0.02;
  constexpr double kQuantisation = 1.0 / 12.0;
  constexpr double kPriorPixels = 20;
  Fit fit{{prior.mean, InnerMatrix::Zero()}, noise_variance, {}, prior.mean};
  InnerVector& x = fit.belief.mean;
  for (int i = 0; i < (std::abs(x[kGrowth]) > kLargeGrowth ? kMoreIterations : kMaxIterations); ++i) {
    fit.at = x;
    fit.sums = sum_up(pixels, x, outwards, i == 0 ? 1e6 : 3 * std::sqrt(fit.variance));
    fit.variance =
        std::max(kQuantisation, (fit.sums.cost + kPriorPixels * noise_variance) /
                                    std::max(1.0, fit.sums.pixels + kPriorPixels - kInnerUnknowns));
    fit.belief = gauss_newton(fit.sums, fit.variance, prior, prior.precision(), x);
    for (const InnerUnknown blur : {kBlurS, kBlurT})
      x[blur] = std::clamp(x[blur], prior.mean[blur] - 0.5, prior.mean[blur] + 0.5);
    x[kGrowth] = std::clamp(x[kGrowth], -kMostGrowth, kMostGrowth);
    if (i > 0 && std::abs(x[kGrowth] - fit.at[kGrowth]) < kSettledBlurs) break;
  }
  return fit;
}

/// Conditions on some unknowns being 0; the ln of how much likelier the data are then (Dickey, "The weighted
/// likelihood ratio", 1971).
template <std::size_t N>
double set_to_zero(const std::array<InnerUnknown, N>& which, const Prior& prior, Belief& belief) {
  Eigen::Matrix<double, kInnerUnknowns, N> columns;
  Eigen::Matrix<double, N, 1> there;
  Eigen::Matrix<double, N, N> between;
  double log_ratio = 0;
  for (std::size_t i = 0; i < N; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    columns.col(at) = belief.covariance.col(which[i]);
    there[at] = belief.mean[which[i]];
    log_ratio += std::log(prior.sigma[which[i]]);
    for (std::size_t k = 0; k < N; ++k)
      between(at, static_cast<Eigen::Index>(k)) = belief.covariance(which[i], which[k]);
  }
  const Eigen::Matrix<double, N, N> inverse = between.inverse();
  log_ratio -= 0.5 * std::log(between.determinant()) + 0.5 * there.dot(inverse * there);
  belief.mean -= columns * (inverse * there);
  belief.covariance -= columns * inverse * columns.transpose();
  return log_ratio;
}

/// Mean of what is believed with and without growth, with and without slopes of the levels, each by how
/// likely it is.
Belief averaged(const Belief& all, const Prior& prior) {
  constexpr double kLogOdds = 3;  // against either: most pictures have neither, and little is lost by waiting
  std::array<Belief, 4> beliefs = {all, all, all, all};
  std::array<double, 4> log_weight{};
  for (std::size_t i = 0; i < 4; ++i) {
    if ((i & 1U) != 0) log_weight[i] += kLogOdds + set_to_zero(std::array{kGrowth}, prior, beliefs[i]);
    if ((i & 2U) != 0) log_weight[i] += kLogOdds + set_to_zero(kSlopes, prior, beliefs[i]);
  }
  const double most = *std::ranges::max_element(log_weight);
  double sum = 0;
  for (const double weight : log_weight) sum += std::exp(weight - most);
  Belief mean{InnerVector::Zero(), InnerMatrix::Zero()};
  for (std::size_t i = 0; i < 4; ++i) mean.mean += std::exp(log_weight[i] - most) / sum * beliefs[i].mean;
  for (std::size_t i = 0; i < 4; ++i) {
    const InnerVector off = beliefs[i].mean - mean.mean;
    mean.covariance += std::exp(log_weight[i] - most) / sum * (beliefs[i].covariance + off * off.transpose());
  }
  return mean;
}

/// How the unknowns move (kFrom, kTo) of the four edges outwards.
Eigen::Matrix<double, 8, kInnerUnknowns> edges_by_unknowns(const InnerVector& x, double outwards) {
  Eigen::Matrix<double, 8, kInnerUnknowns> J = Eigen::Matrix<double, 8, kInnerUnknowns>::Zero();
  constexpr std::array<double, 4> kDirection = {1, 1, -1, -1};  // of the edges along s, t
  for (int k = 0; k < 4; ++k) {
    const int from = 2 * k + kFrom;
    const int to = 2 * k + kTo;
    J(from, kGrowth) = J(to, kGrowth) = outwards * mean_blur_px(x);
    const double turn = kDirection[static_cast<std::size_t>(k)] * px_per_level(x, outwards);
    J(to, k % 2 == 0 ? kBlackS : kBlackT) = turn;
    J(from, k % 2 == 0 ? kBlackS : kBlackT) = -turn;
    J(to, k % 2 == 0 ? kWhiteS : kWhiteT) = 0.5 * turn;
    J(from, k % 2 == 0 ? kWhiteS : kWhiteT) = -0.5 * turn;
  }
  return J;
}

/// What is left out of the model of a growth: a blur is not quite Gaussian, least of all where the picture
/// was overexposed and then interpolated, scaled or compressed.
double growth_doubt_px(const InnerVector& x) {
  constexpr double kShare = 0.06;
  return kShare * std::abs(x[kGrowth]) * mean_blur_px(x);
}

/// How far the border edges lie from where the bits alone would have them, in standard deviations of the
/// difference: the largest of the four.
double contradiction(const Fit& fit, const Prior& prior) {
  const double floor_px =
      std::hypot(0.03, growth_doubt_px(fit.belief.mean));  // print, bends that are not known
  InnerVector precision = prior.precision();
  for (const InnerUnknown free : {kShiftS, kShiftT, kStretchS, kStretchT}) precision[free] = 1.0;
  for (const InnerUnknown slope : kSlopes) precision[slope] /= 25;
  const Belief free = gauss_newton(fit.sums, fit.variance, prior, precision, fit.at);
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
  constexpr double kModelBlurs = 0.01;  // of the growth: a blur is not quite Gaussian
  const bool reversed = family(id.family).reversed_border;
  const double outwards = reversed ? -1.0 : 1.0;
  InnerPixels pixels;
  read_inner_pixels(image, id, tag, estimate, pixels);
  const Prior prior = prior_of(estimate, reversed);
  Fit all = fit(pixels, prior, estimate.noise_variance, outwards);
  EdgeCorrection correction;
  if (!all.belief.mean.allFinite()) return correction;
  correction.worst_sigmas = contradiction(all, prior);
  const double doubt = growth_doubt_px(all.belief.mean) / mean_blur_px(all.belief.mean);
  all.belief.covariance(kGrowth, kGrowth) += kModelBlurs * kModelBlurs + doubt * doubt;
  const Belief belief = averaged(all.belief, prior);
  const auto J = edges_by_unknowns(belief.mean, outwards);
  correction.outwards_px = J * belief.mean;
  correction.covariance_px2 = J * belief.covariance * J.transpose();
  return correction;
}

}  // namespace waymark::refinement
