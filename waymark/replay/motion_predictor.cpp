#include "waymark/replay/motion_predictor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace waymark {
namespace {

constexpr Duration kRemembered = std::chrono::seconds(2);
constexpr Duration kStep = std::chrono::milliseconds(10);
/// Maximum prediction time. A longer gap is a fault, which the limiter reports.
constexpr Duration kMaxPrediction = std::chrono::milliseconds(500);
/// Weight of the initial turn gain, as squared turns [rad^2]. A third of a second in a curve outweighs it, so
/// a robot that turns a third less than commanded does not leave the route in the first bend.
constexpr double kPriorWeight = 3e-4;
/// A larger turn between two estimates is a correction, not motion.
constexpr double kMaxTurn_rad = 0.2;

Duration seconds(double s) { return Duration(std::llround(s * 1e9)); }

double share(double dt_s, double lag_s) { return lag_s > 0 ? 1 - std::exp(-dt_s / lag_s) : 1; }

}  // namespace

void MotionPredictor::sent(SensorTime now, const VelocityCommand& command) {
  if (!commands_.empty() && now < commands_.back().stamp) commands_.clear();  // the clock jumped back
  commands_.push_back({now, command});
  while (commands_.size() > 1 && commands_[1].stamp + kRemembered < now) commands_.pop_front();
}

SensorTime MotionPredictor::acts_at(SensorTime now) const { return now + seconds(options_.command_delay_s); }

VelocityCommand MotionPredictor::acting(SensorTime at) const {
  const SensorTime sent_by = at - seconds(options_.command_delay_s);
  for (auto it = commands_.rbegin(); it != commands_.rend(); ++it) {
    if (it->stamp <= sent_by) return it->command;
  }
  return {};
}

void MotionPredictor::run(Motors& motors, SensorTime to, SE2* map_T_base) const {
  while (motors.stamp < to) {
    const Duration dt = std::min(kStep, to - motors.stamp);
    const double dt_s = to_seconds(dt);
    const VelocityCommand command = acting(motors.stamp);
    motors.speed_m_s += (command.speed_m_s - motors.speed_m_s) * share(dt_s, options_.speed_lag_s);
    motors.yaw_rate_rad_s +=
        (command.yaw_rate_rad_s - motors.yaw_rate_rad_s) * share(dt_s, options_.yaw_rate_lag_s);
    motors.turned_rad += motors.yaw_rate_rad_s * dt_s;
    motors.stamp += dt;
    if (map_T_base == nullptr) continue;
    const double turn = turning_.gain * motors.yaw_rate_rad_s;
    const Eigen::Vector3d way(motors.speed_m_s, -turning_.centre_m * turn, turn);
    *map_T_base = *map_T_base * SE2::exp(way * dt_s);
  }
}

void MotionPredictor::learn_gain(double asked_rad, double turned_rad, double dt_s) {
  constexpr double kLeastRate = 0.04;  // slower turns contribute more noise than information about the gain
  if (options_.turn_gain_time_s <= 0 || std::abs(asked_rad) < kLeastRate * dt_s) return;
  if (std::abs(turned_rad) > kMaxTurn_rad || std::abs(asked_rad) > kMaxTurn_rad) return;
  const double keep = std::exp(-dt_s / options_.turn_gain_time_s);
  asked_asked_ = keep * asked_asked_ + asked_rad * asked_rad;
  asked_turned_ = keep * asked_turned_ + asked_rad * turned_rad;
  const double gain = (asked_turned_ + kPriorWeight * options_.turn_gain) / (asked_asked_ + kPriorWeight);
  turning_.gain =
      std::clamp(gain, options_.turn_gain_min, std::max(options_.turn_gain_min, options_.turn_gain_max));
}

/// Uses turns over half a second, during which corrections of the estimate are small compared with the
/// motion.
void MotionPredictor::learn_centre(SensorTime stamp, const SE2& map_T_base) {
  constexpr Duration kTurn = std::chrono::milliseconds(500);
  constexpr double kPriorTurns = 0.1;      // weight of the initial centre [rad^2]
  constexpr double kMaxSideways_m = 0.03;  // a larger sideways motion is a correction of the estimate
  if (options_.turn_centre_time_s <= 0) return;
  if (turned_since_ && stamp - *turned_since_ < kTurn) return;
  const bool follows = turned_since_ && stamp - *turned_since_ < 2 * kTurn;
  const double dt_s = follows ? to_seconds(stamp - *turned_since_) : 0;
  const Eigen::Vector3d moved = (map_T_turned_since_.inverse() * map_T_base).log();
  turned_since_ = stamp;
  map_T_turned_since_ = map_T_base;
  if (!follows || std::abs(moved.y()) > kMaxSideways_m) return;
  const double keep = std::exp(-dt_s / options_.turn_centre_time_s);
  turned_turned_ = keep * turned_turned_ + moved.z() * moved.z();
  turned_sideways_ = keep * turned_sideways_ + moved.z() * moved.y();
  const double centre_m =
      (kPriorTurns * options_.turn_centre_m - turned_sideways_) / (turned_turned_ + kPriorTurns);
  turning_.centre_m = std::clamp(centre_m, -options_.turn_centre_most_m, options_.turn_centre_most_m);
}

void MotionPredictor::observe(SensorTime stamp, const SE2& map_T_base, bool trusted) {
  if (motors_ && stamp <= motors_->stamp && motors_->stamp - stamp < kMaxPrediction) return;
  const bool follows = motors_ && stamp > motors_->stamp && stamp - motors_->stamp < kMaxPrediction;
  if (!follows) {
    const VelocityCommand now = acting(stamp);
    motors_ = Motors{stamp, now.speed_m_s, now.yaw_rate_rad_s, 0};
    map_T_base_ = map_T_base;
    turned_since_.reset();
    return;
  }
  const double dt_s = to_seconds(stamp - motors_->stamp);
  motors_->turned_rad = 0;
  run(*motors_, stamp, nullptr);
  const double turned = std::remainder(map_T_base.yaw() - map_T_base_.yaw(), 2 * std::numbers::pi);
  if (trusted) {
    learn_gain(motors_->turned_rad, turned, dt_s);
    learn_centre(stamp, map_T_base);
  } else {
    turned_since_.reset();
  }
  map_T_base_ = map_T_base;
}

PredictedMotion MotionPredictor::predict(SensorTime to) const {
  if (!motors_) return {};
  Motors motors = *motors_;
  SE2 pose = map_T_base_;
  run(motors, std::min(to, motors.stamp + kMaxPrediction), &pose);
  return {pose, motors.speed_m_s, turning_.gain * motors.yaw_rate_rad_s};
}

}  // namespace waymark
