#include "waymark/tags/inner_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "waymark/tags/edge_model.hpp"

namespace waymark::refinement {
namespace {

constexpr std::array kSlopes = {kBlackS, kBlackT, kWhiteS, kWhiteT};

/// Conditions on some unknowns being 0; the ln of how much likelier the data are then (Dickey, "The weighted
/// likelihood ratio", 1971).
template <std::size_t N>
double set_to_zero(const std::array<InnerUnknown, N>& which, const InnerPrior& prior, InnerBelief& belief) {
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

}  // namespace

InnerPrior inner_prior(double black, double step, double log_blur, const InnerDoubts& doubts) {
  constexpr double kGrowthBlurs = 0.25;
  InnerPrior prior;
  prior.mean[kBlack] = black;
  prior.mean[kWhite] = step;
  prior.mean[kBlurS] = prior.mean[kBlurT] = log_blur;
  prior.sigma[kBlack] = prior.sigma[kWhite] = doubts.level * step;
  for (const InnerUnknown slope : kSlopes) prior.sigma[slope] = doubts.slope * step;
  prior.sigma[kGrowth] = kGrowthBlurs;
  prior.sigma[kBlurS] = prior.sigma[kBlurT] = doubts.log_blur;
  for (int i = kShiftS; i <= kTaperT; ++i) prior.sigma[i] = doubts.place_blurs;
  constexpr double kLeast = 1e-3;  // 0 has no inverse
  for (int i = kSqueezeS; i <= kBendT; ++i) prior.sigma[i] = std::max(kLeast, doubts.bend_blurs);
  return prior;
}

template <int Unknowns>
InnerBelief gauss_newton(const InnerSums& sums, double variance, const InnerPrior& prior,
                         const InnerVector& precision, const InnerVector& x) {
  using Square = Eigen::Matrix<double, Unknowns, Unknowns>;
  Square information = sums.information.topLeftCorner<Unknowns, Unknowns>() / variance;
  information.diagonal() += precision.head<Unknowns>();
  const Square covariance = information.llt().solve(Square::Identity());
  InnerBelief belief{x, InnerMatrix::Zero()};
  belief.covariance.topLeftCorner<Unknowns, Unknowns>() = covariance;
  belief.mean.head<Unknowns>() +=
      covariance * (sums.gradient / variance + precision.cwiseProduct(prior.mean - x)).head<Unknowns>();
  return belief;
}

template <int Unknowns>
InnerFit fit_inner(const InnerPixels& pixels, const InnerPrior& prior, double noise_variance,
                   double outwards) {
  constexpr int kMaxIterations = 3;
  constexpr int kMoreIterations = 8;  // of a growth that is large: an overexposed print
  constexpr double kLargeGrowth = 0.3;
  constexpr double kMostGrowth = 2.5;
  constexpr double kSettledBlurs = 0.02;
  constexpr double kQuantisation = 1.0 / 12.0;
  constexpr double kPriorPixels = 20;
  InnerFit fit{{prior.mean, InnerMatrix::Zero()}, noise_variance, {}, prior.mean};
  InnerVector& x = fit.belief.mean;
  for (int i = 0; i < (std::abs(x[kGrowth]) > kLargeGrowth ? kMoreIterations : kMaxIterations); ++i) {
    fit.at = x;
    fit.sums = sum_up<Unknowns>(pixels, x, outwards, i == 0 ? 1e6 : 3 * std::sqrt(fit.variance));
    fit.variance = std::max(kQuantisation, (fit.sums.cost + kPriorPixels * noise_variance) /
                                               std::max(1.0, fit.sums.pixels + kPriorPixels - Unknowns));
    fit.belief = gauss_newton<Unknowns>(fit.sums, fit.variance, prior, prior.precision(), x);
    for (const InnerUnknown blur : {kBlurS, kBlurT})
      x[blur] = std::clamp(x[blur], prior.mean[blur] - 0.5, prior.mean[blur] + 0.5);
    x[kGrowth] = std::clamp(x[kGrowth], -kMostGrowth, kMostGrowth);
    if (i > 0 && std::abs(x[kGrowth] - fit.at[kGrowth]) < kSettledBlurs) break;
  }
  return fit;
}

template InnerBelief gauss_newton<kUnknownsOnBorder>(const InnerSums&, double, const InnerPrior&,
                                                     const InnerVector&, const InnerVector&);
template InnerFit fit_inner<kUnknownsOnBorder>(const InnerPixels&, const InnerPrior&, double, double);
template InnerFit fit_inner<kInnerUnknowns>(const InnerPixels&, const InnerPrior&, double, double);

double growth_doubt_px(const InnerVector& x) {
  constexpr double kShare = 0.06;
  return kShare * std::abs(x[kGrowth]) * mean_blur_px(x);
}

InnerBelief averaged(const InnerFit& fit, const InnerPrior& prior) {
  constexpr double kModelBlurs = 0.01;  // of the growth: a blur is not quite Gaussian
  constexpr double kLogOdds = 3;  // against either: most pictures have neither, and little is lost by waiting
  InnerBelief all = fit.belief;
  const double doubt = growth_doubt_px(all.mean) / mean_blur_px(all.mean);
  all.covariance(kGrowth, kGrowth) += kModelBlurs * kModelBlurs + doubt * doubt;
  std::array<InnerBelief, 4> beliefs = {all, all, all, all};
  std::array<double, 4> log_weight{};
  for (std::size_t i = 0; i < 4; ++i) {
    if ((i & 1U) != 0) log_weight[i] += kLogOdds + set_to_zero(std::array{kGrowth}, prior, beliefs[i]);
    if ((i & 2U) != 0) log_weight[i] += kLogOdds + set_to_zero(kSlopes, prior, beliefs[i]);
  }
  const double most = *std::ranges::max_element(log_weight);
  double sum = 0;
  for (const double weight : log_weight) sum += std::exp(weight - most);
  InnerBelief mean{InnerVector::Zero(), InnerMatrix::Zero()};
  for (std::size_t i = 0; i < 4; ++i) mean.mean += std::exp(log_weight[i] - most) / sum * beliefs[i].mean;
  for (std::size_t i = 0; i < 4; ++i) {
    const InnerVector off = beliefs[i].mean - mean.mean;
    mean.covariance += std::exp(log_weight[i] - most) / sum * (beliefs[i].covariance + off * off.transpose());
  }
  return mean;
}

EdgesByInner edges_by_growth(const InnerVector& x, double outwards) {
  EdgesByInner J = EdgesByInner::Zero();
  J.col(kGrowth).setConstant(outwards * mean_blur_px(x));
  return J;
}

}  // namespace waymark::refinement
