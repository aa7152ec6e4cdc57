#include "waymark/runtime/commission_trace.hpp"

#include <cmath>
#include <variant>

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

}  // namespace waymark
