#include "waymark/replay/safety_limiter.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace waymark {
namespace {

/// The first reason to stop. Written so that a NaN is a reason.
std::optional<std::string> reason_to_stop(const VelocityCommand& wanted, const SafetyInputs& in,
                                          const SafetyOptions& options) {
  if (!std::isfinite(wanted.speed_m_s) || !std::isfinite(wanted.yaw_rate_rad_s))
    return "the controller gave no number";
  if (std::isinf(in.odometry_age_s)) return "no odometry arrived yet";
  if (!(in.odometry_age_s <= options.max_odometry_age_s)) {
    return fmt::format("odometry is {:.2f} s old (limit {:.2f} s)", in.odometry_age_s,
                       options.max_odometry_age_s);
  }
  if (!in.localized) return "the position is not known: no mapped tag was seen yet";
  if (!(in.position_sigma_m <= options.stop_position_sigma_m)) {
    return fmt::format("the position is known only to {:.2f} m (limit {:.2f} m)", in.position_sigma_m,
                       options.stop_position_sigma_m);
  }
  if (!(std::abs(in.cross_track_m) <= options.max_cross_track_m)) {
    return fmt::format("{:.2f} m from the route (limit {:.2f} m)", std::abs(in.cross_track_m),
                       options.max_cross_track_m);
  }
  if (!(in.clearance_m >= options.min_clearance_m)) {
    return fmt::format("a tag is {:.2f} m from the hull (limit {:.2f} m)", in.clearance_m,
                       options.min_clearance_m);
  }
  return std::nullopt;
}

double approach(double last, double wanted, double most) {
  return std::clamp(wanted, last - most, last + most);
}

}  // namespace

SafetyVerdict limit(const VelocityCommand& wanted, const SafetyInputs& inputs, const SafetyOptions& options) {
  SafetyVerdict verdict;
  verdict.stopped = reason_to_stop(wanted, inputs, options);
  if (verdict.stopped) return verdict;  // zero at once: the motors' own lag is ramp enough

  double share = 1;
  const auto shrink = [&](double value, double most) {
    if (std::abs(value) * share > most) share = most / std::abs(value);
  };
  if (inputs.position_sigma_m > options.slow_position_sigma_m) {
    verdict.slowed = true;
    share = (options.stop_position_sigma_m - inputs.position_sigma_m) /
            std::max(options.stop_position_sigma_m - options.slow_position_sigma_m, 1e-9);
    share = std::clamp(share, 0.2, 1.0);
  }
  // Both shrink together, so that the curvature stays as steered.
  shrink(wanted.speed_m_s, options.max_speed_m_s);
  shrink(wanted.yaw_rate_rad_s, options.max_yaw_rate_rad_s);
  const double dt_s = std::clamp(inputs.dt_s, 0.0, 0.5);
  const double speed = share * wanted.speed_m_s;
  const bool braking = std::abs(speed) < std::abs(inputs.last.speed_m_s);
  verdict.command.speed_m_s =
      braking ? speed : approach(inputs.last.speed_m_s, speed, options.max_acceleration_m_s2 * dt_s);
  // Turning follows the speed that is really sent.
  const double turning = speed != 0 ? share * wanted.yaw_rate_rad_s * verdict.command.speed_m_s / speed
                                    : share * wanted.yaw_rate_rad_s;
  verdict.command.yaw_rate_rad_s =
      approach(inputs.last.yaw_rate_rad_s, turning, options.max_yaw_acceleration_rad_s2 * dt_s);
  return verdict;
}

std::optional<std::string> start_refusal(double distance_m, double heading_error_rad,
                                         const SafetyOptions& options) {
  const double degrees = heading_error_rad * 180 / std::numbers::pi;
  if (!(std::abs(distance_m) <= options.start_distance_m)) {
    return fmt::format("the robot is {:.2f} m to the {} of the route: put it within {:.2f} m",
                       std::abs(distance_m), distance_m > 0 ? "left" : "right", options.start_distance_m);
  }
  if (!(std::abs(heading_error_rad) <= options.start_angle_rad)) {
    return fmt::format("the robot points {:.0f} degrees to the {} of the route: turn it along the route",
                       std::abs(degrees), degrees > 0 ? "left" : "right");
  }
  return std::nullopt;
}

}  // namespace waymark
