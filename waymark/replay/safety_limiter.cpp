#include "waymark/replay/safety_limiter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

/// After a stop due to position uncertainty the limit is lower, so that the robot does not alternate between
/// creeping and stopping.
double most_sigma_m(const SafetyInputs& in, const SafetyOptions& options) {
  return in.unsure ? std::min(options.slow_position_sigma_m, options.stop_position_sigma_m)
                   : options.stop_position_sigma_m;
}

/// The first reason to stop. Comparisons are written so that a NaN also causes a stop.
std::optional<std::string> reason_to_stop(const VelocityCommand& wanted, const SafetyInputs& in,
                                          const SafetyOptions& options) {
  if (!std::isfinite(wanted.speed_m_s) || !std::isfinite(wanted.yaw_rate_rad_s))
    return "the controller returned a non-finite command";
  if (!in.alarm.empty()) return in.alarm;
  if (!std::isfinite(in.last.speed_m_s) || !std::isfinite(in.last.yaw_rate_rad_s))
    return "the last command was not finite";
  if (std::isinf(in.odometry_age_s)) return "no odometry received";
  if (in.odometry_age_s < -options.max_odometry_age_s)
    return fmt::format("odometry is stamped {:.2f} s in the future: two different clocks",
                       -in.odometry_age_s);
  if (!(in.odometry_age_s <= options.max_odometry_age_s)) {
    return fmt::format("the newest odometry is {:.2f} s old (limit {:.2f} s)", in.odometry_age_s,
                       options.max_odometry_age_s);
  }
  if (!(in.gyro_age_s <= options.max_odometry_age_s))
    return fmt::format("the newest gyro sample is {:.2f} s old (limit {:.2f} s)", in.gyro_age_s,
                       options.max_odometry_age_s);
  if (!(in.scan_age_s <= options.max_scan_age_s))
    return fmt::format("the newest lidar scan is {:.2f} s old (limit {:.2f} s)", in.scan_age_s,
                       options.max_scan_age_s);
  if (!(in.image_age_s <= options.max_image_age_s))
    return fmt::format("the newest image is {:.2f} s old (limit {:.2f} s). Is the camera connected?",
                       in.image_age_s, options.max_image_age_s);
  if (!(in.blind_m <= in.taught_blind_m + options.max_blind_m))
    return fmt::format(
        "no accepted tag for {:.2f} m (limit {:.2f} m: {:.2f} m more than in the taught lap){}{}", in.blind_m,
        in.taught_blind_m + options.max_blind_m, options.max_blind_m, in.missed.empty() ? "" : "; ",
        in.missed);
  if (!in.localized) return "the position is unknown: no mapped tag has been observed";
  if (in.contradicting_frames > options.max_contradicting_frames)
    return "observed tags contradict the estimated pose. Was the robot moved by hand?";
  if (const double most = most_sigma_m(in, options); !(in.position_sigma_m <= most)) {
    return fmt::format("the standard deviation of the position is {:.2f} m (limit {:.2f} m{}){}{}",
                       in.position_sigma_m, most, in.unsure ? " to continue" : "",
                       in.missed.empty() ? "" : "; ", in.missed);
  }
  if (!(std::abs(in.cross_track_m) <= options.max_cross_track_m)) {
    return fmt::format("the robot is {:.2f} m from the route (limit {:.2f} m)", std::abs(in.cross_track_m),
                       options.max_cross_track_m);
  }
  if (!(in.clearance_m >= options.min_clearance_m)) {
    return fmt::format("a tag is {:.2f} m from the hull (limit {:.2f} m)", in.clearance_m,
                       options.min_clearance_m);
  }
  if (!(in.obstacle_m >= options.stop_obstacle_m)) {
    return fmt::format("obstacle {:.2f} m ahead (limit {:.2f} m)", in.obstacle_m, options.stop_obstacle_m);
  }
  return std::nullopt;
}

/// Moves towards `wanted` by at most `up`, or by at most `down` when slowing towards zero; never crosses zero
/// in one step.
double ramp(double last, double wanted, double up, double down) {
  if (last < 0 || (last == 0 && wanted < 0)) return -ramp(-last, -wanted, up, down);
  if (wanted >= last) return std::min(wanted, last + up);
  return std::max({wanted, 0.0, last - down});
}

/// Brakes along the current curve.
VelocityCommand braked(const SafetyInputs& in, const SafetyOptions& options, double dt_s) {
  VelocityCommand last = in.last;
  if (!std::isfinite(last.speed_m_s)) return {};
  last.speed_m_s = std::clamp(last.speed_m_s, -options.max_speed_m_s, options.max_speed_m_s);
  const double speed = ramp(last.speed_m_s, 0, 0, options.max_deceleration_m_s2 * dt_s);
  if (speed == 0 || !std::isfinite(last.yaw_rate_rad_s)) return {speed, 0};
  const double yaw_rate = last.yaw_rate_rad_s * speed / last.speed_m_s;
  return {speed, std::clamp(yaw_rate, -options.max_yaw_rate_rad_s, options.max_yaw_rate_rad_s)};
}

constexpr double kLeastShare = 0.2;

/// 1 where slowing down begins, decreasing to a fifth at the stop limit.
double share_of(double value, double slow, double stop) {
  const double between = slow - stop;
  return std::abs(between) > 1e-9 ? std::clamp((value - stop) / between, kLeastShare, 1.0) : kLeastShare;
}

/// Fraction of the requested speed that position uncertainty and obstacles allow.
double share_left(const VelocityCommand& wanted, const SafetyInputs& in, const SafetyOptions& options) {
  double share = in.contradicting_frames > 0 ? kLeastShare : 1;
  if (in.position_sigma_m > options.slow_position_sigma_m)
    share = std::min(
        share, share_of(in.position_sigma_m, options.slow_position_sigma_m, options.stop_position_sigma_m));
  if (in.obstacle_m < options.slow_obstacle_m && wanted.speed_m_s != 0)
    share = std::min(share, share_of(in.obstacle_m, options.slow_obstacle_m, options.stop_obstacle_m));
  return share;
}

}  // namespace

SafetyVerdict limit(const VelocityCommand& wanted, const SafetyInputs& inputs, const SafetyOptions& options) {
  SafetyVerdict verdict;
  const double dt_s = std::isfinite(inputs.dt_s) ? std::clamp(inputs.dt_s, 0.0, 0.5) : 0.0;
  verdict.stopped = reason_to_stop(wanted, inputs, options);
  if (verdict.stopped) {
    verdict.unsure = !(inputs.position_sigma_m <= most_sigma_m(inputs, options));
    verdict.command = braked(inputs, options, dt_s);
    return verdict;
  }
  double share = share_left(wanted, inputs, options);
  verdict.slowed = share < 1;
  // Speed and yaw rate are scaled together, so that the curvature does not change.
  const auto shrink = [&](double value, double most) {
    if (std::abs(value) * share > most) share = most / std::abs(value);
  };
  shrink(wanted.speed_m_s, options.max_speed_m_s);
  shrink(wanted.yaw_rate_rad_s, options.max_yaw_rate_rad_s);
  const double speed = share * wanted.speed_m_s;
  verdict.command.speed_m_s = ramp(inputs.last.speed_m_s, speed, options.max_acceleration_m_s2 * dt_s,
                                   options.max_deceleration_m_s2 * dt_s);
  // The yaw rate follows the speed that is actually sent.
  double turning = share * wanted.yaw_rate_rad_s;
  if (speed != 0) turning *= std::clamp(verdict.command.speed_m_s / speed, -2.0, 2.0);
  const double most_change = options.max_yaw_acceleration_rad_s2 * dt_s;
  turning =
      std::clamp(turning, inputs.last.yaw_rate_rad_s - most_change, inputs.last.yaw_rate_rad_s + most_change);
  double most = options.max_yaw_rate_rad_s;
  if (options.max_curvature_1_m > 0)
    most = std::min(most, options.max_curvature_1_m * std::abs(verdict.command.speed_m_s));
  verdict.command.yaw_rate_rad_s = std::clamp(turning, -most, most);
  return verdict;
}

std::optional<std::string> start_refusal(double distance_m, double heading_error_rad,
                                         const SafetyOptions& options) {
  const double degrees = to_degrees(heading_error_rad);
  if (!(std::abs(distance_m) <= options.start_distance_m)) {
    return fmt::format("the robot is {:.2f} m to the {} of the route (limit {:.2f} m): move it closer",
                       std::abs(distance_m), distance_m > 0 ? "left" : "right", options.start_distance_m);
  }
  if (!(std::abs(heading_error_rad) <= options.start_angle_rad)) {
    return fmt::format("the robot points {:.0f} degrees to the {} of the route: align it with the route",
                       std::abs(degrees), degrees > 0 ? "left" : "right");
  }
  return std::nullopt;
}

namespace {

/// Position relative to a circle tangent to the base heading: the distance along it and the offset to the
/// left.
struct Along {
  double way_m = 0;
  double beside_m = 0;
};

Along along_curve(const Eigen::Vector2d& base_p, double curvature_1_m) {
  if (std::abs(curvature_1_m) < 1e-3) return {base_p.x(), base_p.y()};
  const double radius = 1 / curvature_1_m;
  const Eigen::Vector2d from_centre = base_p - Eigen::Vector2d(0, radius);
  const double sign = radius > 0 ? 1 : -1;
  const double angle = std::atan2(from_centre.x() * sign, -from_centre.y() * sign);
  return {angle * std::abs(radius), sign * (std::abs(radius) - from_centre.norm())};
}

}  // namespace

double free_way_m(const LaserScan& scan, const SE2& base_T_lidar, const Hull& hull, double curvature_1_m,
                  bool backwards, double margin_m, double reach_m) {
  double free_m = std::numeric_limits<double>::infinity();
  const double front = backwards ? hull.rear_m : hull.front_m;
  for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
    const double range = static_cast<double>(scan.ranges_m[i]);
    if (!(range >= scan.range_min_m && range <= scan.range_max_m)) continue;
    const double angle = scan.angle_min_rad + static_cast<double>(i) * scan.angle_increment_rad;
    Eigen::Vector2d p = base_T_lidar * Eigen::Vector2d(range * std::cos(angle), range * std::sin(angle));
    const bool inside = p.x() > -hull.rear_m && p.x() < hull.front_m && std::abs(p.y()) < hull.width_m / 2;
    if (inside) continue;
    if (backwards) p.x() = -p.x();  // mirrored
    const Along at = along_curve(p, curvature_1_m);
    if (std::abs(at.beside_m) > hull.width_m / 2 + margin_m) continue;
    const double way = at.way_m - front;
    if (at.way_m > 0 && way < reach_m) free_m = std::min(free_m, std::max(way, 0.0));
  }
  return free_m;
}

}  // namespace waymark
