#include "waymark/tags/refinement/inner_bits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "waymark/families/family.hpp"
#include "waymark/tags/refinement/edge_model.hpp"

namespace waymark::refinement {
namespace {

/// Outward displacements of the ends of the border edges along s and along t relative to the fitted ones, at
/// s = 1 and t = 1 [px].
std::array<double, 2> turns(const InnerVector& x, double outwards) {
  const double px = px_per_level(x, outwards);
  return {px * (x[kBlackS] + 0.5 * x[kWhiteS]), px * (x[kBlackT] + 0.5 * x[kWhiteT])};
}

InnerPoint inner_point(const InnerVector& x, double outwards, double trusted,
                       const std::array<double, 2>& keystone, bool skew_matters) {
  InnerPoint point{};
  for (int i = 0; i < kInnerUnknowns; ++i) point.x[i] = static_cast<float>(x[i]);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    point.inverse_blur[axis] = static_cast<float>(std::exp(-x[axis == 0 ? kBlurS : kBlurT]));
    point.keystone[axis] = static_cast<float>(keystone[axis]);
  }
  point.outwards = static_cast<float>(outwards);
  point.trusted = static_cast<float>(trusted);
  point.skew_matters = skew_matters;
  return point;
}

}  // namespace

double mean_blur_px(const InnerVector& x) { return std::exp(0.5 * (x[kBlurS] + x[kBlurT])); }

double px_per_level(const InnerVector& x, double outwards) {
  return 2.0 * std::sqrt(std::numbers::pi) * mean_blur_px(x) / x[kWhite] * outwards;
}

InnerKernels portable_inner_kernels() { return inner::kernels<Lanes>(); }

InnerKernels fastest_inner_kernels() {
#ifdef WAYMARK_AVX2
  static const bool kHasAvx2 = __builtin_cpu_supports("avx2") > 0 && __builtin_cpu_supports("fma") > 0;
  if (kHasAvx2) return avx2_inner_kernels();
#endif
  return portable_inner_kernels();
}

template <int Unknowns>
InnerSums sum_up(const InnerPixels& pixels, const InnerVector& x, double outwards, double trusted,
                 const InnerKernels& kernels) {
  constexpr bool kOnBorder = Unknowns == kUnknownsOnBorder;
  const std::array<double, 2> keystone = kOnBorder ? turns(x, outwards) : std::array<double, 2>{};
  const SumInner sum = kOnBorder ? kernels.on_border : kernels.all;
  InnerFloats floats{};
  sum(pixels.block.data(), pixels.blocks(), inner_point(x, outwards, trusted, keystone, pixels.skew_matters),
      floats);
  InnerSums sums;
  for (int i = 0; i < Unknowns; ++i) {
    for (int k = i; k < Unknowns; ++k)
      sums.information(i, k) = sums.information(k, i) = static_cast<double>(floats.information[i][k]);
    sums.gradient[i] = static_cast<double>(floats.gradient[i]);
  }
  sums.cost = static_cast<double>(floats.cost);
  sums.pixels = static_cast<double>(floats.pixels);
  return sums;
}

template InnerSums sum_up<kUnknownsOnBorder>(const InnerPixels&, const InnerVector&, double, double,
                                             const InnerKernels&);
template InnerSums sum_up<kInnerUnknowns>(const InnerPixels&, const InnerVector&, double, double,
                                          const InnerKernels&);

namespace {

constexpr std::array kSlopes = {kBlackS, kBlackT, kWhiteS, kWhiteT};

/// Conditions the estimate on some unknowns being 0. Returns the logarithm of the resulting likelihood ratio
/// (Dickey, "The weighted likelihood ratio", 1971).
template <int Unknowns, std::size_t N>
double set_to_zero(const std::array<InnerUnknown, N>& which, const InnerPrior& prior,
                   InnerEstimate& estimate) {
  auto covariance = estimate.covariance.topLeftCorner<Unknowns, Unknowns>();
  Eigen::Matrix<double, Unknowns, N> columns;
  Eigen::Matrix<double, N, 1> there;
  Eigen::Matrix<double, N, N> between;
  double log_ratio = 0;
  for (std::size_t i = 0; i < N; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    columns.col(at) = covariance.col(which[i]);
    there[at] = estimate.mean[which[i]];
    log_ratio += std::log(prior.sigma[which[i]]);
    for (std::size_t k = 0; k < N; ++k)
      between(at, static_cast<Eigen::Index>(k)) = covariance(which[i], which[k]);
  }
  const Eigen::Matrix<double, N, N> inverse = between.inverse();
  log_ratio -= 0.5 * std::log(between.determinant()) + 0.5 * there.dot(inverse * there);
  const Eigen::Matrix<double, Unknowns, N> gain = columns.lazyProduct(inverse);
  estimate.mean.head<Unknowns>() -= gain.lazyProduct(there);
  covariance -= gain.lazyProduct(columns.transpose());
  return log_ratio;
}

}  // namespace

InnerPrior inner_prior(double black, double step, double log_blur, const InnerSigmas& sigmas) {
  constexpr double kGrowthBlurs = 0.25;
  InnerPrior prior;
  prior.mean[kBlack] = black;
  prior.mean[kWhite] = step;
  prior.mean[kBlurS] = prior.mean[kBlurT] = log_blur;
  prior.sigma[kBlack] = prior.sigma[kWhite] = sigmas.level * step;
  for (const InnerUnknown slope : kSlopes) prior.sigma[slope] = sigmas.slope * step;
  prior.sigma[kGrowth] = kGrowthBlurs;
  prior.sigma[kBlurS] = prior.sigma[kBlurT] = sigmas.log_blur;
  for (int i = kShiftS; i <= kTaperT; ++i) prior.sigma[i] = sigmas.place_blurs;
  constexpr double kMinSigma = 1e-3;  // because 0 has no inverse
  for (int i = kSqueezeS; i <= kBendT; ++i) prior.sigma[i] = std::max(kMinSigma, sigmas.bend_blurs);
  return prior;
}

InnerPrior saturated_prior(double black, double step, double log_blur, const InnerSigmas& sigmas) {
  constexpr double kBeyond = 3;  // expected step, in visible steps
  InnerPrior prior = inner_prior(black, step, log_blur, sigmas);
  prior.mean[kWhite] = kBeyond * step;
  prior.sigma[kWhite] = kBeyond * step;
  prior.sigma[kWhiteS] = prior.sigma[kWhiteT] = sigmas.slope * kBeyond * step;
  prior.blur_range = 1.0;
  prior.iterations = 10;
  return prior;
}

namespace {

template <int Unknowns>
using UnknownsMatrix = Eigen::Matrix<double, Unknowns, Unknowns>;

/// The information about the unknowns from pixels of this variance and from the prior, as a factorisation.
template <int Unknowns>
Eigen::LLT<UnknownsMatrix<Unknowns>> factor(const InnerSums& sums, double variance,
                                            const InnerVector& precision) {
  UnknownsMatrix<Unknowns> information = sums.information.topLeftCorner<Unknowns, Unknowns>() / variance;
  information.diagonal() += precision.head<Unknowns>();
  return information.llt();
}

/// The step from `x` in the first `Unknowns` unknowns; the others remain constant.
template <int Unknowns>
InnerVector gauss_newton_step(const Eigen::LLT<UnknownsMatrix<Unknowns>>& information, const InnerSums& sums,
                              double variance, const InnerPrior& prior, const InnerVector& precision,
                              const InnerVector& x) {
  const InnerVector gradient = sums.gradient / variance + precision.cwiseProduct(prior.mean - x);
  InnerVector step = InnerVector::Zero();
  step.head<Unknowns>() = information.solve(gradient.head<Unknowns>());
  return step;
}

template <int Unknowns>
InnerMatrix inverse_of(const Eigen::LLT<UnknownsMatrix<Unknowns>>& information) {
  InnerMatrix covariance = InnerMatrix::Zero();
  covariance.topLeftCorner<Unknowns, Unknowns>() = information.solve(UnknownsMatrix<Unknowns>::Identity());
  return covariance;
}

}  // namespace

template <int Unknowns>
InnerEstimate gauss_newton(const InnerSums& sums, double variance, const InnerPrior& prior,
                           const InnerVector& precision, const InnerVector& x) {
  const auto information = factor<Unknowns>(sums, variance, precision);
  return {x + gauss_newton_step<Unknowns>(information, sums, variance, prior, precision, x),
          inverse_of<Unknowns>(information)};
}

template <int Unknowns>
InnerFit fit_inner(const InnerPixels& pixels, const InnerPrior& prior, const InnerVector& start,
                   double noise_variance, double outwards) {
  constexpr int kMoreIterations = 8;  // needed for a large growth, as in an overexposed print
  constexpr double kSlowGrowth = 0.3;
  constexpr double kMaxGrowth = 2.5;
  constexpr double kToleranceBlurs = 0.02;
  constexpr double kQuantisation = 1.0 / 12.0;
  constexpr double kPriorPixels = 20;
  constexpr double kWhiteTolerance = 0.01;
  constexpr double kWhiteFactor = 8;
  constexpr int kMaxIterationsWithFixedWhite = 3;  // white is known well enough
  InnerFit fit{{start, InnerMatrix::Zero()}, noise_variance, {}, start};
  InnerVector& x = fit.estimate.mean;
  const InnerVector precision = prior.precision();
  const InnerKernels kernels = fastest_inner_kernels();
  std::optional<Eigen::LLT<UnknownsMatrix<Unknowns>>> information;
  const auto most = [&] {
    return std::max(prior.iterations, std::abs(x[kGrowth]) > kSlowGrowth ? kMoreIterations : 0);
  };
  for (int i = 0; i < most(); ++i) {
    fit.at = x;
    fit.sums = sum_up<Unknowns>(pixels, x, outwards, i == 0 ? 1e6 : 3 * std::sqrt(fit.variance), kernels);
    fit.variance = std::max(kQuantisation, (fit.sums.cost + kPriorPixels * noise_variance) /
                                               std::max(1.0, fit.sums.pixels + kPriorPixels - Unknowns));
    information.emplace(factor<Unknowns>(fit.sums, fit.variance, precision));
    x += gauss_newton_step<Unknowns>(*information, fit.sums, fit.variance, prior, precision, x);
    for (const InnerUnknown blur : {kBlurS, kBlurT})
      x[blur] = std::clamp(x[blur], prior.mean[blur] - prior.blur_range, prior.mean[blur] + prior.blur_range);
    x[kGrowth] = std::clamp(x[kGrowth], -kMaxGrowth, kMaxGrowth);
    if (prior.iterations > kMaxIterationsWithFixedWhite)
      x[kWhite] = std::clamp(x[kWhite], prior.mean[kWhite] / kWhiteFactor, prior.mean[kWhite] * kWhiteFactor);
    const bool white_settled = prior.iterations <= kMaxIterationsWithFixedWhite ||
                               std::abs(x[kWhite] - fit.at[kWhite]) < kWhiteTolerance * x[kWhite];
    if (i > 0 && white_settled && std::abs(x[kGrowth] - fit.at[kGrowth]) < kToleranceBlurs) break;
  }
  if (information) fit.estimate.covariance = inverse_of<Unknowns>(*information);
  return fit;
}

template InnerEstimate gauss_newton<kUnknownsOnBorder>(const InnerSums&, double, const InnerPrior&,
                                                       const InnerVector&, const InnerVector&);
template InnerFit fit_inner<kUnknownsOnBorder>(const InnerPixels&, const InnerPrior&, const InnerVector&,
                                               double, double);
template InnerFit fit_inner<kInnerUnknowns>(const InnerPixels&, const InnerPrior&, const InnerVector&, double,
                                            double);

double growth_sigma_px(const InnerVector& x) {
  constexpr double kShare = 0.06;
  return kShare * std::abs(x[kGrowth]) * mean_blur_px(x);
}

template <int Unknowns>
InnerEstimate averaged(const InnerFit& fit, const InnerPrior& prior) {
  constexpr double kModelBlurs = 0.01;  // error of the growth, because a blur is not exactly Gaussian
  // Prior odds against either effect: most images have neither, and deciding late costs little.
  constexpr double kLogOdds = 3;
  InnerEstimate all = fit.estimate;
  const double sigma = growth_sigma_px(all.mean) / mean_blur_px(all.mean);
  all.covariance(kGrowth, kGrowth) += kModelBlurs * kModelBlurs + sigma * sigma;
  std::array<InnerEstimate, 4> beliefs = {all, all, all, all};
  std::array<double, 4> log_weight{};
  for (std::size_t i = 0; i < 4; ++i) {
    if ((i & 1U) != 0)
      log_weight[i] += kLogOdds + set_to_zero<Unknowns>(std::array{kGrowth}, prior, beliefs[i]);
    if ((i & 2U) != 0) log_weight[i] += kLogOdds + set_to_zero<Unknowns>(kSlopes, prior, beliefs[i]);
  }
  const double most = *std::ranges::max_element(log_weight);
  double sum = 0;
  for (const double weight : log_weight) sum += std::exp(weight - most);
  InnerEstimate mean{InnerVector::Zero(), InnerMatrix::Zero()};
  for (std::size_t i = 0; i < 4; ++i) mean.mean += std::exp(log_weight[i] - most) / sum * beliefs[i].mean;
  auto covariance = mean.covariance.topLeftCorner<Unknowns, Unknowns>();
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Matrix<double, Unknowns, 1> off = (beliefs[i].mean - mean.mean).head<Unknowns>();
    const double weight = std::exp(log_weight[i] - most) / sum;
    covariance += weight * beliefs[i].covariance.topLeftCorner<Unknowns, Unknowns>();
    covariance += (weight * off).lazyProduct(off.transpose());
  }
  return mean;
}

template InnerEstimate averaged<kUnknownsOnBorder>(const InnerFit&, const InnerPrior&);
template InnerEstimate averaged<kInnerUnknowns>(const InnerFit&, const InnerPrior&);

Matrix8 edge_covariance(const EdgesByInner& J, const InnerMatrix& covariance) {
  const EdgesByInner by_unknowns = J.lazyProduct(covariance);
  return by_unknowns.lazyProduct(J.transpose());
}

EdgesByInner edges_by_growth(const InnerVector& x, double outwards) {
  EdgesByInner J = EdgesByInner::Zero();
  J.col(kGrowth).setConstant(outwards * mean_blur_px(x));
  return J;
}

namespace {

/// The priors: levels and blur are close to those of the border, and the pattern is placed by the border.
InnerPrior prior_of(const TagEstimate& estimate, bool reversed) {
  const double step = std::abs(estimate.mean[kStep - kOwn]);
  const double black = estimate.mean[kInnerLevel - kOwn] - (reversed ? step : 0);
  return inner_prior(black, step, estimate.mean[kLogBlur - kOwn], {});
}

/// Derivatives of the outward displacements (kFrom, kTo) of the four edges with respect to the unknowns.
EdgesByInner edges_by_unknowns(const InnerVector& x, double outwards) {
  EdgesByInner J = edges_by_growth(x, outwards);
  constexpr std::array<double, 4> kDirection = {1, 1, -1, -1};  // direction of each edge along s or t
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

/// Distance of the border edges from their positions according to the bits alone, in standard deviations of
/// the difference; the largest of the four edges.
double contradiction(const InnerFit& fit, const InnerPrior& prior) {
  const double floor_px = std::hypot(0.03, growth_sigma_px(fit.estimate.mean));  // print and curvature errors
  InnerVector precision = prior.precision();
  for (const InnerUnknown free : {kShiftS, kShiftT, kStretchS, kStretchT}) precision[free] = 1.0;
  for (const InnerUnknown slope : kSlopes) precision[slope] /= 25;
  const InnerEstimate free =
      gauss_newton<kUnknownsOnBorder>(fit.sums, fit.variance, prior, precision, fit.at);
  const double blur_px = mean_blur_px(fit.estimate.mean);
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

EdgeCorrection inner_correction(const ImageView& image, const PrintedTag& print, const TagBands& tag,
                                const TagEstimate& estimate) {
  const bool reversed = print.bright_border();
  const double outwards = print.outwards();
  InnerPixels pixels;
  read_inner_pixels(image, print, tag, estimate, InnerPixels::kCorrectionPixels, pixels);
  const InnerPrior prior = prior_of(estimate, reversed);
  const InnerFit all =
      fit_inner<kUnknownsOnBorder>(pixels, prior, prior.mean, estimate.noise_variance, outwards);
  EdgeCorrection correction;
  if (!all.estimate.mean.allFinite()) return correction;
  correction.worst_sigmas = contradiction(all, prior);
  const InnerEstimate corrected = averaged<kUnknownsOnBorder>(all, prior);
  const EdgesByInner J = edges_by_unknowns(corrected.mean, outwards);
  correction.outwards_px = J * corrected.mean;
  correction.covariance_px2 = edge_covariance(J, corrected.covariance);
  return correction;
}

}  // namespace waymark::refinement
