#include "waymark/mapping/odometry_noise.hpp"

#include <cmath>

namespace waymark {
namespace {

/// Mean squares of the whitened residuals as they are expected to be once the poses are known exactly.
Eigen::Vector3d expected_squares(const Bundle& bundle) {
  std::vector<std::pair<PoseIndex, PoseIndex>> pairs;
  for (const OdometryTerm& term : bundle.odometry) pairs.emplace_back(term.a, term.b);
  const BundleCovariance P = covariance(bundle, pairs);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < bundle.odometry.size(); ++i) {
    const OdometryTerm& term = bundle.odometry[i];
    OdometryJacobians J;
    const Eigen::Vector3d r = odometry_residual(term.factor, bundle.odometry_scales[term.scales].value,
                                                bundle.poses[term.a].value, bundle.poses[term.b].value, &J);
    const Eigen::Matrix3d spread = J.a * P.poses[term.a] * J.a.transpose() +
                                   J.b * P.poses[term.b] * J.b.transpose() +
                                   2 * J.a * P.pairs[i] * J.b.transpose();
    sum += r.cwiseAbs2() + spread.diagonal().cwiseMax(0.0);
  }
  return sum / static_cast<double>(bundle.odometry.size());
}

}  // namespace

OdometryNoise fit_odometry_noise(LapBundle& lap, int max_iterations, const BundleProgress& progress) {
  constexpr int kRounds = 15;
  constexpr double kEnough = 0.03;
  constexpr double kLongerSteps = 1.8;  // the method takes small ones, always in the right direction
  OdometryNoise noise = OdometryNoise::Ones();
  if (lap.bundle.odometry.empty()) return noise;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Vector3d squares = expected_squares(lap.bundle).cwiseMax(0.04).cwiseMin(25.0);
    const Eigen::Vector3d factor = squares.array().pow(kLongerSteps / 2);
    noise = noise.cwiseProduct(factor);
    for (OdometryTerm& term : lap.bundle.odometry)
      term.factor.whitening = factor.cwiseInverse().asDiagonal() * term.factor.whitening;
    if (!solve(lap.bundle, {.max_iterations = max_iterations}, progress).usable()) break;
    if (squares.array().log().abs().maxCoeff() < kEnough) break;
  }
  return noise;
}

}  // namespace waymark
