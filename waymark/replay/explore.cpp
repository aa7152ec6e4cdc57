#include "waymark/replay/explore.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMaxRange_m = 3;
/// Robots turn less than commanded. The lidar confirms that the space is free, so the limit need not be
/// exact.
constexpr double kStuckTurns = 3;

}  // namespace

void Explorer::add(const LaserScan& scan) {
  scan_stamp_ = scan.stamp;
  free_ahead_m_ = kInfinity;
  const Hull& hull = robot_.hull;
  const double half_m = hull.width_m / 2 + options_.beside_m;
  double left_m = 0;
  double right_m = 0;
  int left = 0;
  int right = 0;
  for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
    const double range_m = static_cast<double>(scan.ranges_m[i]);
    const double angle = scan.angle_min_rad + static_cast<double>(i) * scan.angle_increment_rad;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    const bool seen = range_m >= scan.range_min_m && range_m <= scan.range_max_m;  // false for NaN
    const double reach_m = seen ? std::min(range_m, kMaxRange_m) : kMaxRange_m;
    const double base_y = (base_T_lidar_.rotation() * direction).y();
    (base_y > 0 ? left_m : right_m) += reach_m;
    ++(base_y > 0 ? left : right);
    if (!seen) continue;
    const Eigen::Vector2d base_p = base_T_lidar_ * Eigen::Vector2d(range_m * direction);
    if (std::abs(base_p.y()) <= half_m && base_p.x() > 0)
      free_ahead_m_ = std::min(free_ahead_m_, base_p.x() - hull.front_m);
  }
  near_left_m_ = left > 0 ? left_m / left : kMaxRange_m;
  near_right_m_ = right > 0 ? right_m / right : kMaxRange_m;
}

bool Explorer::blocked() const { return free_ahead_m_ < options_.ahead_m; }

VelocityCommand Explorer::forward(double dt_s) {
  // Ornstein-Uhlenbeck process with standard deviation heading_noise_rad_s and correlation time
  // heading_noise_s.
  const double keep = std::exp(-dt_s / options_.heading_noise_s);
  wander_rad_s_ = keep * wander_rad_s_ +
                  random_.normal(0, options_.heading_noise_rad_s) * std::sqrt(std::max(0.0, 1 - keep * keep));
  // Drives more slowly in tight spaces, so that the robot can stop in time.
  const double room = std::clamp((free_ahead_m_ - options_.ahead_m) / options_.ahead_m, 0.3, 1.0);
  return {options_.speed_m_s * room, wander_rad_s_};
}

VelocityCommand Explorer::turn(double dt_s) {
  left_to_turn_rad_ -= options_.yaw_rate_rad_s * dt_s;
  return {0, side_ * options_.yaw_rate_rad_s};
}

ExploreStep Explorer::step(SensorTime now) {
  const double dt_s = last_step_ ? std::clamp(to_seconds(now - *last_step_), 0.0, 0.5) : 0.05;
  last_step_ = now;
  const auto stop_with_reason = [&](std::string reason) {
    return ExploreStep{.state = state_, .command = {}, .reason = std::move(reason)};
  };
  if (!scan_stamp_) return stop_with_reason("no lidar scan received");
  const double age_s = to_seconds(now - *scan_stamp_);
  if (!(std::abs(age_s) <= options_.max_scan_age_s))
    return stop_with_reason(fmt::format("the newest lidar scan is {:.2f} s old (limit {:.2f} s)", age_s,
                                        options_.max_scan_age_s));
  if (state_ != ExploreState::Turn && blocked()) {
    state_ = ExploreState::Turn;
    ++turns_;
    side_ = near_left_m_ >= near_right_m_ ? 1 : -1;
    left_to_turn_rad_ =
        random_.uniform(to_radians(options_.least_turn_deg), to_radians(options_.most_turn_deg));
    wander_rad_s_ = 0;
  }
  if (state_ == ExploreState::Turn) {
    const bool boxed_in = left_to_turn_rad_ < -kStuckTurns * 2 * std::numbers::pi;
    if (boxed_in && blocked()) return stop_with_reason("obstacles on all sides: move the robot by hand");
    if (left_to_turn_rad_ > 0 || blocked()) return {.state = state_, .command = turn(dt_s)};
  }
  state_ = ExploreState::Forward;
  return {.state = state_, .command = forward(dt_s)};
}

}  // namespace waymark
