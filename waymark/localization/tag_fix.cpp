#include "waymark/localization/tag_fix.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark {
namespace {

/// Degrees of freedom of Student's t distribution for the residuals of a tag; fewer degrees of freedom result
/// in heavier tails.
constexpr double kStudentFreedom = 4;
/// Standard deviation of roll and pitch due to the springs while the robot brakes, is held, or drives over an
/// obstacle.
constexpr double kTilt_rad = 0.02;

struct Normal {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  int tags = 0;
};

/// Adds one tag at a pose, weighted according to its residual. The covariance includes the lasting position
/// error that the tag does not share with its neighbours, because fixes are compared with each other over
/// short times. It also includes the tilt of the robot, which rotates the camera about the base.
void add(const Linearised& z, const Landmark& landmark, const RiekfOptions& options, Normal& sum) {
  const double m2 = options.tag_sigma_m * options.tag_sigma_m;
  const double rad2 = options.tag_sigma_rad * options.tag_sigma_rad;
  Eigen::Matrix<double, 6, 6> P = landmark.own_covariance;
  P.diagonal() += (Eigen::Matrix<double, 6, 1>() << m2, m2, m2, rad2, rad2, rad2).finished();
  const Eigen::Matrix<double, 6, 8> PH = P.lazyProduct(z.H_tag.transpose());
  Eigen::Matrix<double, 8, 8> S = z.H_tag.lazyProduct(PH);
  const Eigen::Matrix<double, 8, 2> tilt = kTilt_rad * z.H_mount.middleCols<2>(3);
  S += tilt.lazyProduct(tilt.transpose());
  S.diagonal().array() += 1;  // rows beyond z.rows are zero and add nothing
  const Eigen::LLT<Eigen::Matrix<double, 8, 8>> L(S);
  const Eigen::Matrix<double, 8, 1> r = L.solve(z.residual);
  const Eigen::Matrix<double, 8, 3> J = L.solve(z.H_pose);
  const double chi2 = z.residual.dot(r);
  const double weight = std::min(1.0, (kStudentFreedom + z.rows) / (kStudentFreedom + chi2));
  sum.H += weight * z.H_pose.transpose().lazyProduct(J);
  sum.g += weight * z.H_pose.transpose().lazyProduct(r);
  ++sum.tags;
}

/// Whether a tag is used. If all tags in an image are under suspicion, all of them are used.
bool counts(const Observation& observation, std::span<const Observation> seen, const TagWatch& watch) {
  if (watch.usable(observation.landmark)) return true;
  return std::ranges::none_of(seen, [&](const Observation& other) { return watch.usable(other.landmark); });
}

Normal normal_at(const SE2& map_T_base, std::span<const Observation> seen, const Landmarks& landmarks,
                 const TagWatch& watch, const MountedSensor& sensor, const RiekfOptions& options) {
  Normal sum;
  for (const Observation& observation : seen) {
    if (!counts(observation, seen, watch)) continue;
    if (const auto z = linearise(observation, landmarks, sensor, map_T_base))
      add(*z, landmarks[observation.landmark], options, sum);
  }
  return sum;
}

}  // namespace

std::optional<TagFix> fix_of(std::span<const Observation> seen, const Landmarks& landmarks,
                             const TagWatch& watch, const MountedSensor& sensor, const RiekfOptions& options,
                             const SE2& near, double most_sigma_m) {
  constexpr int kIterations = 20;
  constexpr double kConverged = 0.02;  // as a share of the standard deviation; the weights converge slowly
  SE2 at = near;
  for (int i = 0; i < kIterations; ++i) {
    const Normal sum = normal_at(at, seen, landmarks, watch, sensor, options);
    const Eigen::LLT<Eigen::Matrix3d> L(sum.H);
    if (sum.tags == 0 || L.info() != Eigen::Success) return std::nullopt;
    const Eigen::Vector3d step = -L.solve(sum.g);
    if (!step.allFinite()) return std::nullopt;
    at = plus(step, at);
    if (step.dot(sum.H * step) > kConverged * kConverged) continue;
    TagFix fix{.map_T_base = at, .tags = sum.tags};
    const Eigen::Matrix3d P = L.solve(Eigen::Matrix3d::Identity());
    fix.covariance = coordinate_covariance(Uncertain<SE2>{at, P});
    const bool known = fix.covariance.topLeftCorner<2, 2>().trace() < most_sigma_m * most_sigma_m;
    return known ? std::optional(fix) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace waymark
