#include "waymark/samples/odometry_jump.hpp"

#include <cmath>

namespace waymark {
namespace {

/// Samples may be missing in between; the speed bounds the distance if the robot drove to the origin.
bool back_at_origin(const Odometry& before, const Odometry& now, double way_m, double dt_s) {
  constexpr double kAtOrigin_m = 0.02;
  constexpr double kAtOrigin_rad = 0.05;
  constexpr double kAfar_m = 0.3;
  constexpr double kFaster = 2;  // the robot may have accelerated in between
  return now.odom_T_base.translation().norm() < kAtOrigin_m &&
         std::abs(now.odom_T_base.yaw()) < kAtOrigin_rad &&
         way_m > kAfar_m + kFaster * std::abs(before.speed_m_s) * dt_s;
}

/// A robot that drives to the origin does not stop there this exactly.
bool restarted_at_origin(const Odometry& now, double way_m) {
  constexpr double kExactly = 1e-3;  // in m, rad and m/s
  constexpr double kAfar_m = 0.1;
  return way_m > kAfar_m && now.odom_T_base.translation().norm() < kExactly &&
         std::abs(now.odom_T_base.yaw()) < kExactly && std::abs(now.speed_m_s) < kExactly;
}

}  // namespace

bool faster_than_any_robot(double distance_m, double turn_rad, double dt_s) {
  constexpr double kFastest_m_s = 5;
  constexpr double kNoise_m = 0.1;
  constexpr double kFastestTurn_rad_s = 15;
  constexpr double kTurn_rad = 0.3;
  return distance_m > kNoise_m + kFastest_m_s * dt_s ||
         std::abs(turn_rad) > kTurn_rad + kFastestTurn_rad_s * dt_s;
}

bool odometry_jumped(const Odometry& before, const Odometry& now) {
  const double dt_s = to_seconds(now.stamp - before.stamp);
  if (!(dt_s > 0)) return false;
  const SE2 step = before.odom_T_base.inverse() * now.odom_T_base;
  const double way_m = step.translation().norm();
  return faster_than_any_robot(way_m, step.yaw(), dt_s) || back_at_origin(before, now, way_m, dt_s) ||
         restarted_at_origin(now, way_m);
}

}  // namespace waymark
