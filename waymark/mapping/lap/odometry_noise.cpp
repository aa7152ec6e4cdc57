#include "waymark/mapping/lap/odometry_noise.hpp"

#include <cmath>

namespace waymark {
namespace {

/// Terms of the wheels that follow each other, from the first to before the last.
struct Stretch {
  std::size_t first = 0, last = 0;
};

/// Every term by itself, or as many together as last so long.
std::vector<Stretch> stretches(const std::vector<OdometryTerm>& odometry, double least_s) {
  std::vector<Stretch> result;
  for (std::size_t i = 0; i < odometry.size();) {
    Stretch stretch{i, i};
    double lasts_s = 0;
    do {
      lasts_s += odometry[stretch.last++].factor.duration_s;
    } while (lasts_s < least_s && stretch.last < odometry.size() &&
             odometry[stretch.last].a == odometry[stretch.last - 1].b);
    i = stretch.last;
    if (lasts_s >= least_s) result.push_back(stretch);
  }
  return result;
}

/// What the wheels say of a stretch as one motion, once scaled; its noise if each part errs by itself.
OdometryFactor joined(const Bundle& bundle, const Stretch& stretch) {
  SE2 motion;
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();
  for (std::size_t i = stretch.first; i < stretch.last; ++i) {
    const OdometryTerm& term = bundle.odometry[i];
    motion = motion * scaled_motion(term.factor, bundle.odometry_scales[term.scales].value);
    variance += term.factor.whitening.diagonal().cwiseAbs2().cwiseInverse();
  }
  return {motion, variance.cwiseSqrt().cwiseInverse().asDiagonal()};
}

/// Mean squares of the whitened residuals as they are expected to be once the poses are known exactly.
Eigen::Vector3d expected_squares(const Bundle& bundle, const std::vector<Stretch>& stretches) {
  std::vector<std::pair<PoseIndex, PoseIndex>> pairs;
  for (const Stretch& s : stretches)
    pairs.emplace_back(bundle.odometry[s.first].a, bundle.odometry[s.last - 1].b);
  const BundleCovariance P = covariance(bundle, pairs);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const auto& [a, b] = pairs[i];
    OdometryJacobians J;
    const Eigen::Vector3d r =
        odometry_residual(joined(bundle, stretches[i]), {}, bundle.poses[a].value, bundle.poses[b].value, &J);
    const Eigen::Matrix3d spread = J.a * P.poses[a] * J.a.transpose() + J.b * P.poses[b] * J.b.transpose() +
                                   2 * J.a * P.pairs[i] * J.b.transpose();
    sum += r.cwiseAbs2() + spread.diagonal().cwiseMax(0.0);
  }
  return sum / static_cast<double>(stretches.size());
}

}  // namespace

OdometryNoise fit_odometry_noise(LapBundle& lap, int max_iterations, const BundleProgress& progress) {
  constexpr int kRounds = 15;
  constexpr double kEnough = 0.03;
  constexpr double kLongerSteps = 1.8;  // the method takes small ones, always in the right direction
  constexpr double kLong_s = 0.5;
  constexpr std::size_t kFewest = 30;
  OdometryNoise noise = OdometryNoise::Ones();
  if (lap.bundle.odometry.empty()) return noise;
  const std::vector<Stretch> single = stretches(lap.bundle.odometry, 0);
  const std::vector<Stretch> together = stretches(lap.bundle.odometry, kLong_s);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Vector3d squares = expected_squares(lap.bundle, single);
    if (together.size() >= kFewest) squares = squares.cwiseMax(expected_squares(lap.bundle, together));
    squares = squares.cwiseMax(0.04).cwiseMin(25.0);
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
