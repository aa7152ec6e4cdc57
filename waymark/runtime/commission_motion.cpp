#include "waymark/runtime/commission_motion.hpp"

#include <cmath>
#include <variant>

#include <fmt/format.h>

#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

void add_tags(MotionTrace& trace, const TagFrame& frame, const TagWitness& witness) {
  const MountedCamera* camera = find_camera(witness.cameras, frame.camera);
  if (camera == nullptr) return;
  for (const TagDetection& detection : frame.detections) {
    const auto seen = estimate_tag_pose(detection, witness.sizes, camera->camera);
    if (!seen) continue;
    const SE3 base_T_tag = camera->base_T_cam * seen->best.cam_T_tag;
    trace.tags.push_back({frame.stamp, detection.tag, base_T_tag.translation().head<2>()});
  }
}

template <class T, class Inside>
std::vector<T> those(const std::vector<T>& all, const Inside& inside) {
  std::vector<T> kept;
  for (const T& one : all) {
    if (inside(one.stamp)) kept.push_back(one);
  }
  return kept;
}

template <class Inside>
MotionTrace part_of(const MotionTrace& trace, const Inside& inside) {
  return {.commanded = trace.commanded,
          .began = trace.began,
          .ceased = trace.ceased,
          .odometry = those(trace.odometry, inside),
          .wheels = those(trace.wheels, inside),
          .imu = those(trace.imu, inside),
          .tags = those(trace.tags, inside)};
}

}  // namespace

void receive(MotionTrace& trace, const Sample& sample, const TagWitness& witness) {
  if (const auto* odometry = std::get_if<Odometry>(&sample)) trace.odometry.push_back(*odometry);
  if (const auto* wheels = std::get_if<WheelTicks>(&sample)) trace.wheels.push_back(*wheels);
  if (const auto* imu = std::get_if<ImuSample>(&sample)) trace.imu.push_back(*imu);
  if (const auto* frame = std::get_if<TagFrame>(&sample)) add_tags(trace, *frame, witness);
}

MotionTrace steady_part(const MotionTrace& trace, double settle_s) {
  if (!trace.began || !trace.ceased) return {.commanded = trace.commanded};
  const SensorTime from = *trace.began + Duration(std::llround(settle_s * 1e9));
  return part_of(trace, [&](SensorTime stamp) { return stamp >= from && stamp <= *trace.ceased; });
}

MotionTrace standing_part(const MotionTrace& trace) {
  return part_of(trace, [&](SensorTime stamp) { return !trace.began || stamp <= *trace.began; });
}

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
  if (!began_) began_ = last_odometry_ = uptime;
  if (trace_.odometry.size() > counted_) last_odometry_ = uptime;
  counted_ = trace_.odometry.size();
  const double silent_s = to_seconds(uptime - *last_odometry_);
  if (counted_ > 0) longest_silence_s_ = std::max(longest_silence_s_, silent_s);
  constexpr double kPatience_s = 3;
  if (silent_s > (counted_ > 0 ? options_.silence_s : kPatience_s))
    return fail(ErrorCode::Unreadable,
                fmt::format("no odometry for {:.1f} s, so the robot was stopped", silent_s), {},
                "Check that the robot's program sends odometry and that its clock runs.");
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
