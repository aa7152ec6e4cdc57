#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "waymark/geometry/se2.hpp"

namespace waymark {

/// What every source says of the motion up to one moment. Sums and poses begin anywhere: differences count.
struct MotionSample {
  double moving_s = 0;       ///< time of motion; it does not pass while the robot stands
  double commanded_m = 0;    ///< along base x, after delay and lag of the motors
  double ramp_m_s = 0;       ///< sum of the changes of the commanded speed: what a wrong lag moves
  double commanded_rad = 0;  ///< turned, after lag of the motors, before slip
  double ramp_rad_s = 0;     ///< sum of the changes of the commanded yaw rate
  double wheels_m = 0;       ///< along base x
  double wheels_rad = 0;     ///< turned, by odometry
  double gyro_rad = 0;       ///< turned, by the gyro
  double gyro_s = 0;         ///< time over which that was summed, standing too
  double path_m = 0;         ///< length of the way by the wheels
  double turned_rad = 0;     ///< sum of the turns to either side
  SE2 odom_T_base{};         ///< by wheels after the learnt scale, and gyro where there is one
  SE2 map_T_base{};          ///< by tags: the estimate, or the tags of one picture alone
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of its x, y [m] and yaw [rad]
  bool tags = false;  ///< the pose rests on a tag that was accepted a moment ago
};

/// How well the sources are known to agree.
struct MotionScales {
  bool gyro = false;             ///< the robot has one
  double distance_share = 0.02;  ///< uncertainty of the distance of the wheels, as a share
  double turn_share = 0.35;      ///< uncertainty of turns by odometry: the floor may change
  double turn_noise_sqrt_m = 0;  ///< random walk of turns by odometry, rad per square root of a metre
  double turn_scale = 1;         ///< true turn over that of odometry
  double command_scale = 1;      ///< turn of the robot over the commanded one
  double command_share = 0.5;    ///< its uncertainty
  double sigmas = 2;             ///< deviations of a pose by tags that count as its uncertainty
};

namespace internal {

/// Two moments, and what the sources say of the motion between them.
struct Cut {
  const MotionSample& from;
  const MotionSample& to;
};

/// An angle within half a turn to either side.
[[nodiscard]] double straight(double angle_rad);
[[nodiscard]] double turned_by_tags(const Cut& cut);
[[nodiscard]] double turned_by_odometry(const Cut& cut);
/// The way of the tags beside that of odometry, in the base at the beginning.
[[nodiscard]] Eigen::Vector2d apart(const Cut& cut);

/// Deviation of both positions of a cut along a direction of the map [m].
[[nodiscard]] double position_sigma(const Cut& cut, const Eigen::Vector2d& map_direction);
/// Deviation of both headings of a cut [rad].
[[nodiscard]] double yaw_sigma(const Cut& cut);
/// Larger deviation of the position of a pose [m].
[[nodiscard]] double largest_sigma(const MotionSample& sample);
/// What noise makes of the turn by odometry of a cut, in as many deviations as count [rad].
[[nodiscard]] double turn_noise(const Cut& cut, const MotionScales& scales);
/// What an unknown bias of the gyro makes of its turn while the robot stood or crept: time of the gyro beyond
/// the time of motion [rad].
[[nodiscard]] double turn_of_bias(const Cut& cut);
/// What scale and noise make of the difference of the turns by odometry, by gyro where there is one, and by
/// tags [rad]. Errors that are independent of each other add up as their squares, here and below.
[[nodiscard]] double doubt_of_turn(const Cut& cut, const MotionScales& scales);
/// What a wrong scale, a wrong heading at the beginning and the noise of both poses make of the difference of
/// the ways by tags and by odometry, along a direction of the base at the beginning [m].
[[nodiscard]] double doubt_of_way(const Cut& cut, const Eigen::Vector2d& direction,
                                  const MotionScales& scales);

/// A window as a whole, and in three parts.
struct Cuts {
  Cut whole;
  std::array<Cut, 3> by_time;  ///< of motion, equal
  std::array<Cut, 3> by_way;   ///< of the wheels, equal
};
[[nodiscard]] Cuts cuts_of(const std::vector<MotionSample>& window);

/// Whether the difference of the whole is above its limit, and every third has its share of it, but for the
/// deviation of its own difference: in time, or in way, where the robot slows down and what slips is a share
/// of the way.
template <class Difference, class Deviation>
[[nodiscard]] bool lasts(const Cuts& cuts, double limit, const Difference& difference,
                         const Deviation& deviation) {
  constexpr double kLastingShare = 0.25;
  const double whole = difference(cuts.whole);
  if (!(std::abs(whole) > limit)) return false;
  const auto has_share = [&](const Cut& part) {
    return difference(part) * (whole > 0 ? 1 : -1) >= kLastingShare * std::abs(whole) - deviation(part);
  };
  return std::ranges::all_of(cuts.by_time, has_share) || std::ranges::all_of(cuts.by_way, has_share);
}

template <class Difference>
[[nodiscard]] bool lasts(const Cuts& cuts, double limit, const Difference& difference) {
  return lasts(cuts, limit, difference, [](const Cut&) { return 0.0; });
}

}  // namespace internal
}  // namespace waymark
