#include "waymark/runtime/commission_motion.hpp"

#include <cmath>

#include <fmt/format.h>

namespace waymark {

void CommissionMotion::receive(const Sample& sample) { waymark::receive(trace_, sample, witness_); }

bool CommissionMotion::motion_over(SensorTime now) const {
  const double for_s = to_seconds(now - *trace_.began);
  if (stop_asked_ || for_s >= options_.most_s) return true;
  if (for_s < options_.least_s || first_moving_ >= trace_.odometry.size()) return false;
  const SE2 moved = trace_.odometry[first_moving_].odom_T_base.inverse() * trace_.odometry.back().odom_T_base;
  const double way_m = moved.translation().norm();
  const double way = options_.command.speed_m_s != 0 ? way_m : std::abs(moved.yaw());
  return way_m >= options_.far_m || (options_.way > 0 && way >= options_.way);
}

Result<DriverDecision> CommissionMotion::decide(Duration uptime, SensorTime now) {
  if (!began_) began_ = heard_ = uptime;
  if (trace_.odometry.size() > counted_) heard_ = uptime;
  counted_ = trace_.odometry.size();
  const double silent_s = to_seconds(uptime - *heard_);
  if (counted_ > 0) longest_silence_s_ = std::max(longest_silence_s_, silent_s);
  constexpr double kPatience_s = 3;
  if (silent_s > (counted_ > 0 ? options_.silence_s : kPatience_s))
    return fail(ErrorCode::Unreadable, fmt::format("no odometry for {:.1f} s: the robot stands", silent_s),
                {}, "Does the robot's program send odometry, and does its clock run?");
  const bool rested = to_seconds(uptime - *began_) >= options_.before_s && counted_ > 0;
  if (!trace_.began && rested) {
    trace_.began = now;
    first_moving_ = counted_ - 1;
  }
  if (moving() && motion_over(now)) trace_.ceased = now;
  const bool done = trace_.ceased && to_seconds(now - *trace_.ceased) >= options_.after_s;
  return DriverDecision{.command = moving() ? options_.command : VelocityCommand{}, .done = done};
}

}  // namespace waymark
