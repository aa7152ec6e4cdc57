#include "waymark/simulation/robot_dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace waymark {
namespace {

/// Towards the target with a first-order lag, and not faster than the limit allows.
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
    : model_(model), options_(options), random_(std::move(random)), map_T_base_(map_T_base) {}

VelocityCommand RobotDynamics::delayed(const VelocityCommand& command) {
  if (pending_.empty() || pending_.back().command != command) pending_.push_back({now_, command});
  while (!pending_.empty() && pending_.front().stamp + seconds(options_.command_delay_s) <= now_) {
    acting_ = pending_.front().command;
    if (pending_.size() == 1) break;  // keeps acting until another comes
    pending_.pop_front();
  }
  return acting_;
}

void RobotDynamics::step(const VelocityCommand& command, Duration dt) {
  const double dt_s = to_seconds(dt);
  const VelocityCommand acting = delayed(command);
  const MotionLimits& limits = model_.limits;
  const double speed = std::clamp(acting.speed_m_s, -limits.speed_m_s, limits.speed_m_s);
  const double yaw_rate = std::clamp(acting.yaw_rate_rad_s, -limits.yaw_rate_rad_s, limits.yaw_rate_rad_s);
  speed_m_s_ = follow(speed_m_s_, speed, options_.speed_lag_s, limits.acceleration_m_s2, dt_s);
  wheel_yaw_rate_rad_s_ =
      follow(wheel_yaw_rate_rad_s_, yaw_rate, options_.yaw_rate_lag_s, limits.yaw_acceleration_rad_s2, dt_s);
  if (now_ >= next_slip_) {
    slip_m_s_ = options_.slip_noise_m_s * random_.normal();
    next_slip_ += seconds(0.1);
  }
  // A standing robot does not slide.
  const double moving = std::min(1.0, std::abs(speed_m_s_) / 0.05);
  const double lateral = options_.lateral_slip_s * speed_m_s_ * yaw_rate_rad_s() + moving * slip_m_s_;
  map_T_base_ = map_T_base_ * SE2::exp({speed_m_s_ * dt_s, lateral * dt_s, yaw_rate_rad_s() * dt_s});
  const double difference = wheel_yaw_rate_rad_s_ * model_.track_m / 2;
  left_rad_ += (speed_m_s_ - difference) / model_.wheel_radius_m * dt_s;
  right_rad_ += (speed_m_s_ + difference) / model_.wheel_radius_m * dt_s;
  now_ += dt;
}

}  // namespace waymark
