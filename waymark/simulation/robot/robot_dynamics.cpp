#include "waymark/simulation/robot/robot_dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace waymark {
namespace {

/// Approaches the target with a first-order lag, within the rate limit.
double follow(double value, double target, double lag_s, double max_rate, double dt_s) {
  const double gain = lag_s > 0 ? 1 - std::exp(-dt_s / lag_s) : 1;
  const double change = (target - value) * gain;
  const double most = max_rate > 0 ? max_rate * dt_s : std::abs(change);
  return value + std::clamp(change, -most, most);
}

Duration seconds(double s) { return Duration(static_cast<std::int64_t>(std::llround(s * 1e9))); }

}  // namespace

RobotDynamics::RobotDynamics(const RobotModel& model, const DynamicsOptions& options, const SE2& map_T_base,
                             Random random)
    : model_(model),
      options_(options),
      random_(std::move(random)),
      steered_(options.drive == "ackermann"),
      map_T_base_(map_T_base) {}

VelocityCommand RobotDynamics::delayed(const VelocityCommand& command) {
  if (pending_.empty() || pending_.back().command != command) pending_.push_back({now_, command});
  while (!pending_.empty() && pending_.front().stamp + seconds(options_.command_delay_s) <= now_) {
    acting_ = pending_.front().command;
    if (pending_.size() == 1) break;  // a command applies until the next one
    pending_.pop_front();
  }
  return acting_;
}

/// The yaw rate of the wheels, produced by a separate actuator or by the direction of the front wheels.
double RobotDynamics::next_wheel_yaw_rate(double asked_rad_s, double asked_m_s, double dt_s) {
  if (!steered_)
    return follow(wheel_yaw_rate_rad_s_, asked_rad_s, options_.yaw_rate_lag_s,
                  model_.limits.yaw_acceleration_rad_s2, dt_s);
  constexpr double kStationary = 1e-3;
  const double most = std::atan(options_.wheelbase_m / options_.min_radius_m);
  if (std::abs(asked_m_s) > kStationary) {
    const double wanted = std::atan(options_.wheelbase_m * asked_rad_s / asked_m_s);
    steering_rad_ = follow(steering_rad_, std::clamp(wanted, -most, most), options_.steering_lag_s,
                           options_.steering_rate_rad_s, dt_s);
  }
  return speed_m_s_ * std::tan(steering_rad_) / options_.wheelbase_m;
}

Eigen::Vector3d RobotDynamics::twist() const {
  if (grip_.held) return Eigen::Vector3d::Zero();
  // A stationary robot does not slide.
  const double moving = std::min(1.0, std::abs(speed_m_s_) / 0.05);
  const double lateral = options_.lateral_slip_s * speed_m_s_ * yaw_rate_rad_s() + moving * slip_m_s_;
  return {grip_.speed_share * speed_m_s_, lateral, yaw_rate_rad_s()};
}

/// The lateral velocity is a first-order Gauss-Markov process: Bar-Shalom, Li and Kirubarajan, "Estimation
/// with Applications to Tracking and Navigation", section 8.2.
void RobotDynamics::slide(double dt_s) {
  // the first draw is from the stationary distribution
  const double kept = slides_ ? std::exp(-dt_s / options_.slip_time_s) : 0;
  slip_m_s_ = kept * slip_m_s_ + options_.slip_noise_m_s * std::sqrt(1 - kept * kept) * random_.normal();
  slides_ = true;
}

void RobotDynamics::step(const VelocityCommand& command, Duration dt) {
  const double dt_s = to_seconds(dt);
  const VelocityCommand acting = delayed(command);
  const MotionLimits& limits = model_.limits;
  const double speed = grip_.motor_share * std::clamp(acting.speed_m_s, -limits.speed_m_s, limits.speed_m_s);
  const double yaw_rate = std::clamp(acting.yaw_rate_rad_s, -limits.yaw_rate_rad_s, limits.yaw_rate_rad_s);
  const double before = speed_m_s_;
  speed_m_s_ = follow(speed_m_s_, speed, options_.speed_lag_s, limits.acceleration_m_s2, dt_s);
  if (grip_.blocked) speed_m_s_ = 0;
  acceleration_m_s2_ = (speed_m_s_ - before) / dt_s;
  wheel_yaw_rate_rad_s_ = grip_.blocked ? 0 : next_wheel_yaw_rate(yaw_rate, speed, dt_s);
  slide(dt_s);
  map_T_base_ = map_T_base_ * SE2::exp(twist() * dt_s);
  const double difference = wheel_yaw_rate_rad_s_ * model_.track_m / 2;
  left_rad_ += (speed_m_s_ - difference) / model_.wheel_radius_m * dt_s;
  right_rad_ += (speed_m_s_ + difference) / model_.wheel_radius_m * dt_s;
  now_ += dt;
}

}  // namespace waymark
