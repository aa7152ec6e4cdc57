#include "waymark/replay/motion_window.hpp"
#include "waymark/geometry/dense.hpp"

#include <numbers>

namespace waymark::internal {

double position_sigma(const Cut& cut, const Eigen::Vector2d& map_direction) {
  const Eigen::Matrix2d P =
      cut.from.covariance.topLeftCorner<2, 2>() + cut.to.covariance.topLeftCorner<2, 2>();
  return std::sqrt(std::max(0.0, map_direction.dot(P * map_direction)));
}

double straight(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

double turned_by_tags(const Cut& cut) {
  return straight(cut.to.map_T_base.yaw() - cut.from.map_T_base.yaw());
}
double turned_by_odometry(const Cut& cut) {
  return straight(cut.to.odom_T_base.yaw() - cut.from.odom_T_base.yaw());
}

Eigen::Vector2d apart(const Cut& cut) {
  const SE2 by_tags = cut.from.map_T_base.inverse() * cut.to.map_T_base;
  const SE2 by_odometry = cut.from.odom_T_base.inverse() * cut.to.odom_T_base;
  return by_tags.translation() - by_odometry.translation();
}

/// The larger of the estimates': their errors go together. Those of two pictures do not.
double yaw_sigma(const Cut& cut) {
  return std::sqrt(std::max(0.0, cut.from.covariance(2, 2) + cut.to.covariance(2, 2)));
}

double largest_sigma(const MotionSample& sample) {
  const Eigen::Vector2d variances_m2 = symmetric_eigenvalues<2>(sample.covariance.topLeftCorner<2, 2>());
  return std::sqrt(std::max(0.0, variances_m2.maxCoeff()));
}

double turn_noise(const Cut& cut, const MotionScales& scales) {
  return scales.sigmas * scales.turn_noise_sqrt_m * std::sqrt(std::max(0.0, cut.to.path_m - cut.from.path_m));
}

double turn_of_bias(const Cut& cut) {
  constexpr double kBias_rad_s = 0.01;
  const double moving_s = cut.to.moving_s - cut.from.moving_s;
  return kBias_rad_s * std::max(0.0, cut.to.gyro_s - cut.from.gyro_s - moving_s);
}

double doubt_of_turn(const Cut& cut, const MotionScales& scales) {
  constexpr double kGyroShare = 0.05;
  const double turned = cut.to.turned_rad - cut.from.turned_rad;
  const double noise = scales.sigmas * yaw_sigma(cut);
  if (scales.gyro) return std::hypot(kGyroShare * turned, noise, turn_of_bias(cut));
  return std::hypot(scales.turn_share * scales.turn_scale * turned, turn_noise(cut, scales), noise);
}

double doubt_of_way(const Cut& cut, const Eigen::Vector2d& direction, const MotionScales& scales) {
  const Eigen::Vector2d way = (cut.from.odom_T_base.inverse() * cut.to.odom_T_base).translation();
  const Eigen::Vector2d across(-way.y(), way.x());
  constexpr double kEvenly = 0.58;  // of a random walk over the way: 1 / sqrt(3)
  const double turned = scales.turn_scale * (cut.to.turned_rad - cut.from.turned_rad);
  const double bend = scales.gyro
                          ? turn_of_bias(cut)
                          : std::hypot(scales.turn_share * turned / 2, kEvenly * turn_noise(cut, scales));
  const double aside = std::sqrt(std::max(0.0, cut.from.covariance(2, 2))) * direction.dot(across);
  const double noise = std::hypot(position_sigma(cut, cut.from.map_T_base.rotation() * direction), aside);
  constexpr double kHeadingShare = 0.02;  // wheels that are not aligned
  return std::hypot(scales.distance_share * direction.dot(way),
                    std::hypot(kHeadingShare, bend) * direction.dot(across), scales.sigmas * noise);
}

Cuts cuts_of(const std::vector<MotionSample>& window) {
  const MotionSample& first = window.front();
  const MotionSample& last = window.back();
  const auto in_thirds = [&](double MotionSample::*const sum) -> std::array<Cut, 3> {
    const auto at = [&](double share) -> const MotionSample& {
      const double value = first.*sum + share * (last.*sum - first.*sum);
      return *std::ranges::lower_bound(window, value - 1e-9, {}, sum);
    };
    const MotionSample& one = at(1.0 / 3);
    const MotionSample& two = at(2.0 / 3);
    return {Cut{first, one}, Cut{one, two}, Cut{two, last}};
  };
  return {{first, last}, in_thirds(&MotionSample::moving_s), in_thirds(&MotionSample::path_m)};
}

}  // namespace waymark::internal
