#pragma once

#include <algorithm>
#include <cmath>
#include <variant>

#include "waymark/samples/robot_samples.hpp"

namespace waymark::python {

// The name of the first non-finite attribute of a sample; empty if all are finite. Images and lidar ranges
// are not checked.

[[nodiscard]] inline const char* not_finite(const Odometry& s) {
  if (!s.odom_T_base.matrix().allFinite()) return "odom_T_base";
  if (!std::isfinite(s.speed_m_s)) return "speed_m_s";
  return std::isfinite(s.yaw_rate_rad_s) ? nullptr : "yaw_rate_rad_s";
}
[[nodiscard]] inline const char* not_finite(const WheelTicks& s) {
  if (!std::isfinite(s.left_rad)) return "left_rad";
  return std::isfinite(s.right_rad) ? nullptr : "right_rad";
}
[[nodiscard]] inline const char* not_finite(const ImuSample& s) {
  if (!s.angular_velocity_rad_s.allFinite()) return "angular_velocity_rad_s";
  return s.linear_acceleration_m_s2.allFinite() ? nullptr : "linear_acceleration_m_s2";
}
[[nodiscard]] inline const char* not_finite(const StampedCommand& s) {
  if (!std::isfinite(s.command.speed_m_s)) return "speed_m_s";
  return std::isfinite(s.command.yaw_rate_rad_s) ? nullptr : "yaw_rate_rad_s";
}
[[nodiscard]] inline const char* not_finite(const TruthPose& s) {
  return s.map_T_base.matrix().allFinite() ? nullptr : "map_T_base";
}
[[nodiscard]] inline const char* not_finite(const RangeBearing& s) {
  if (!std::isfinite(s.range_m)) return "range_m";
  return std::isfinite(s.bearing_rad) ? nullptr : "bearing_rad";
}
[[nodiscard]] inline const char* not_finite(const TagFrame& s) {
  const auto finite = [](const TagDetection& tag) {
    return std::ranges::all_of(tag.corners_px, [](const auto& corner) { return corner.allFinite(); });
  };
  return std::ranges::all_of(s.detections, finite) ? nullptr : "corners_px";
}
[[nodiscard]] inline const char* not_finite(const TagPoseFrame& s) {
  const auto finite = [](const SeenTagPose& tag) { return tag.cam_T_tag.matrix().allFinite(); };
  return std::ranges::all_of(s.tags, finite) ? nullptr : "cam_T_tag";
}
[[nodiscard]] inline const char* not_finite(const GamepadState& s) {
  return std::ranges::all_of(s.axes, [](auto axis) { return std::isfinite(axis); }) ? nullptr : "axes";
}
template <class Other>
[[nodiscard]] const char* not_finite(const Other& /*sample*/) {
  return nullptr;
}
[[nodiscard]] inline const char* not_finite(const Sample& sample) {
  return std::visit([](const auto& one) { return not_finite(one); }, sample);
}

}  // namespace waymark::python
