#include "waymark/tags/tag_fit.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/LU>

namespace waymark::refinement {
namespace {

constexpr int kMeanStep = kStep - kOwn;
constexpr int kMeanLogBlur = kLogBlur - kOwn;

double precision(double sigma) { return 1.0 / (sigma * sigma); }

}  // namespace

TagSolve::TagSolve(const std::array<NormalEquations, 4>& normals, const Priors& priors,
                   const TagEstimate& at) {
  const double step = std::max(1.0, std::abs(at.mean[kMeanStep]));
  tie_ << precision(priors.inner_level * step), precision(priors.step * step), precision(priors.log_blur);
  const double scale = 1.0 / at.noise_variance;
  CommonMatrix mean_information = CommonMatrix::Zero();
  Common mean_gradient = Common::Zero();
  // An edge that is not seen at all keeps its place within a pixel or so; data outweigh this a thousandfold.
  constexpr double kFaint = 0.1;
  constexpr double kNegligible = 1e-4;
  for (std::size_t k = 0; k < 4; ++k) {
    const EdgeVector& x = at.edges[k];
    EdgeMatrix information = scale * normals[k].information;
    EdgeVector gradient = scale * normals[k].gradient;
    const auto expect = [&](int i, double value, double weight) {
      information(i, i) += weight;
      gradient[i] += weight * (value - x[i]);
    };
    expect(kFrom, 0.0, kFaint);
    expect(kTo, 0.0, kFaint);
    expect(kBend, 0.0, precision(std::max(priors.bend_sigma_px[k], kNegligible)));
    expect(kBeyond, 0.0, precision(priors.beyond * step));

    Edge& edge = edges_[k];
    const Coupling cross = information.topRightCorner<kOwn, kCommon>();
    edge.own_covariance = information.topLeftCorner<kOwn, kOwn>().inverse();
    edge.own_by_common = edge.own_covariance * cross;
    edge.own_step = edge.own_covariance * gradient.head<kOwn>();
    CommonMatrix common = information.bottomRightCorner<kCommon, kCommon>();
    common -= cross.transpose() * edge.own_by_common;
    common.diagonal() += tie_;
    edge.common_covariance = common.inverse();
    const Common from_mean = at.mean - x.tail<kCommon>();
    const Common pull =
        gradient.tail<kCommon>() - cross.transpose() * edge.own_step + Common(tie_.cwiseProduct(from_mean));
    edge.common_step = edge.common_covariance * pull;
    // Setting the derivative by the mean to zero: sum over edges of tie (mean - common) = 0.
    mean_information.diagonal() += tie_;
    mean_information -= tie_.asDiagonal() * edge.common_covariance * tie_.asDiagonal();
    mean_gradient += tie_.cwiseProduct(edge.common_step - from_mean);
  }
  const double blur_precision = precision(priors.mean_log_blur);
  mean_information(kMeanLogBlur, kMeanLogBlur) += blur_precision;
  mean_gradient[kMeanLogBlur] += blur_precision * (std::log(priors.blur_px) - at.mean[kMeanLogBlur]);
  mean_covariance_ = mean_information.inverse();
  mean_step_ = mean_covariance_ * mean_gradient;
}

double TagSolve::apply(TagEstimate& estimate) const {
  std::array<EdgeVector, 4> steps;
  double moved = 0;
  double blurred = std::abs(mean_step_[kMeanLogBlur]);
  for (std::size_t k = 0; k < 4; ++k) {
    const Edge& edge = edges_[k];
    const Common common = edge.common_step + edge.common_covariance * tie_.cwiseProduct(mean_step_);
    steps[k] << edge.own_step - edge.own_by_common * common, common;
    moved = std::max(moved, steps[k].head<2>().cwiseAbs().maxCoeff());
    blurred = std::max(blurred, std::abs(steps[k][kLogBlur]));
  }
  constexpr double kLongestPx = 1.0;
  constexpr double kLargestLogBlur = 0.5;
  const double shorten =
      std::min({1.0, kLongestPx / std::max(moved, 1e-9), kLargestLogBlur / std::max(blurred, 1e-9)});
  for (std::size_t k = 0; k < 4; ++k) estimate.edges[k] += shorten * steps[k];
  estimate.mean += shorten * mean_step_;
  // Narrower than a pixel's own box or wider than a band can hold means lost; stay where the model makes
  // sense.
  const auto keep = [](double& log_blur) { log_blur = std::clamp(log_blur, std::log(0.25), std::log(4.0)); };
  keep(estimate.mean[kMeanLogBlur]);
  for (EdgeVector& x : estimate.edges) keep(x[kLogBlur]);
  return moved;
}

Eigen::Matrix<double, 8, 8> TagSolve::displacement_covariance() const {
  Eigen::Matrix<double, 8, 8> covariance;
  for (int k = 0; k < 4; ++k) {
    const Edge& row = edges_[static_cast<std::size_t>(k)];
    const Eigen::Matrix<double, 2, kCommon> by_mean =
        row.own_by_common.topRows<2>() * row.common_covariance * tie_.asDiagonal();
    for (int l = k; l < 4; ++l) {
      const Edge& column = edges_[static_cast<std::size_t>(l)];
      Eigen::Matrix2d block = by_mean * mean_covariance_ * tie_.asDiagonal() * column.common_covariance *
                              column.own_by_common.topRows<2>().transpose();
      if (k == l) {
        block += row.own_covariance.topLeftCorner<2, 2>();
        block += row.own_by_common.topRows<2>() * row.common_covariance *
                 row.own_by_common.topRows<2>().transpose();
      }
      covariance.block<2, 2>(2 * k, 2 * l) = block;
      covariance.block<2, 2>(2 * l, 2 * k) = block.transpose();
    }
  }
  return covariance;
}

}  // namespace waymark::refinement
