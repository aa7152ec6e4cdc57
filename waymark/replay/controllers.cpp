#include "waymark/replay/controllers.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "waymark/replay/speed_profile.hpp"

namespace waymark {

double curvature_about(const Route& route, double arc_length_m, double half_m) {
  double from = arc_length_m - half_m;
  double to = arc_length_m + half_m;
  if (!route.closed) {
    from = std::clamp(from, 0.0, route.length_m);
    to = std::clamp(to, 0.0, route.length_m);
  }
  if (to - from < half_m / 4) return 0;
  const double turn = pose_at(route, to).yaw() - pose_at(route, from).yaw();
  return std::remainder(turn, 2 * std::numbers::pi) / (to - from);
}

VelocityCommand PathFollower::follow(const Route& route, const PredictedMotion& motion,
                                     const RouteProgress& at, double remaining_m,
                                     const ActuatorOptions& actuators, const LearntTurning& turning) const {
  constexpr double kHalfStretch =
      0.05;  // half the length of route over which the curvature used for feed-forward is averaged
  const double planned = speed_at(route, at.index, at.arc_length_m);
  const double way = planned < 0 ? -1 : 1;
  const SE2 route_T_base = at.map_T_route.inverse() * motion.map_T_base;
  const double distance = route_T_base.y();
  // Angle between the base heading and the route; it is not zero because the robot turns about a point other
  // than the base origin.
  const double aside =
      std::atan(way * turning.centre_m * curvature_about(route, at.arc_length_m, kHalfStretch));
  const double heading = route_T_base.yaw() - aside;
  // The yaw rate responds with the motor lag, so the curvature is taken from further along the route. The
  // angle to the route grows with its curvature, so the turn begins earlier by the distance to the centre of
  // rotation.
  const double ahead = std::abs(motion.speed_m_s) * actuators.yaw_rate_lag_s + way * turning.centre_m;
  const double last = at.leg_end_m - at.leg_begin_m > 0 ? at.leg_end_m : route.length_m;
  const double feed_at =
      route.closed ? at.arc_length_m + ahead : std::clamp(at.arc_length_m + ahead, 0.0, last);
  const double curvature = curvature_about(route, feed_at, kHalfStretch);
  const double stretch = std::clamp(1 - way * curvature * distance, 0.3, 3.0);
  const double k_heading = 2 * options_.damping / options_.reach_m;
  const double slope = 1 / (2 * options_.damping * options_.reach_m);
  const double approach =
      std::clamp(std::atan(slope * (distance + offset_m_)), -options_.approach_rad, options_.approach_rad);
  const double turn_per_way =
      curvature * std::cos(heading) / stretch - k_heading * std::sin(heading + way * approach);
  // The distance travelled during the motor lag is not available for braking.
  const double left =
      remaining_m - options_.stop_within_m - std::abs(motion.speed_m_s) * actuators.speed_lag_s;
  const double brake = std::sqrt(std::max(0.0, 2 * options_.brake_m_s2 * left));
  double speed = std::min(std::abs(planned), std::max(brake, 0.05));
  if (std::abs(heading) > std::numbers::pi / 3) speed = std::min(speed, 0.1);  // turn before driving on
  return {way * speed, speed * turn_per_way / std::max(turning.gain, 0.1)};
}

void PathFollower::integrate(const RouteProgress& at, double driven_m) {
  constexpr double kNear = 0.10;  // larger errors have other causes
  if (options_.integral_m <= 0 || std::abs(at.cross_track_m) > kNear || std::abs(driven_m) > 0.5) return;
  offset_m_ += at.cross_track_m * std::abs(driven_m) / options_.integral_m;
  offset_m_ = std::clamp(offset_m_, -options_.integral_most_m, options_.integral_most_m);
}

VelocityCommand pure_pursuit(const Route& route, const SE2& map_T_base, const RouteProgress& progress,
                             const PurePursuitOptions& options) {
  const SE2 map_T_goal = pose_at(route, progress.arc_length_m + options.look_ahead_m);
  const Eigen::Vector2d base_goal = map_T_base.inverse() * map_T_goal.translation();
  const double curvature = 2 * base_goal.y() / std::max(base_goal.squaredNorm(), 1e-4);
  double speed = route.points[progress.index].speed_m_s;
  if (!route.closed && options.slow_down_m > 0) {
    const double left = std::max(0.0, route.length_m - progress.arc_length_m);
    const double most = std::max(options.min_speed_m_s, std::abs(speed) * left / options.slow_down_m);
    speed = std::clamp(speed, -most, most);
  }
  return {speed, speed * curvature};
}

VelocityCommand go_to_pose(const Route& route, const SE2& map_T_base, const RouteProgress& progress,
                           const GoToPoseOptions& options) {
  const double half = options.waypoint_m / 2;  // a goal closer than this counts as reached
  const double goal_m =
      options.waypoint_m * (std::floor((progress.arc_length_m + half) / options.waypoint_m) + 1);
  const Eigen::Vector2d base_goal = map_T_base.inverse() * pose_at(route, goal_m).translation();
  const double aside = std::atan2(base_goal.y(), base_goal.x());
  const double most = std::abs(route.points[progress.index].speed_m_s);
  const double speed = std::abs(aside) > options.turn_first_rad
                           ? 0
                           : std::min(most, options.speed_gain_1_s * base_goal.norm());
  return {speed, options.heading_gain_1_s * aside};
}

}  // namespace waymark
