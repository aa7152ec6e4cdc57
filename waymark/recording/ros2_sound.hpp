#pragma once
// Inside the room: messages whose numbers cannot be those of a robot.

#include <algorithm>
#include <cmath>

#include "waymark/recording/ros2_messages.hpp"

namespace waymark::ros2 {

[[nodiscard]] inline bool sound(const Vector3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
/// A rotation: finite, and not so far from length 1 that it means none.
[[nodiscard]] inline bool sound(const Quaternion& q) {
  const double squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  return squared > 1e-6 && squared < 1e6;
}
[[nodiscard]] inline bool sound(const Pose& p) { return sound(p.position) && sound(p.orientation); }
[[nodiscard]] inline bool sound(const Twist& t) { return sound(t.linear) && sound(t.angular); }
[[nodiscard]] inline bool sound(const PoseStamped& m) { return sound(m.pose); }
[[nodiscard]] inline bool sound(const TwistStamped& m) { return sound(m.twist); }
[[nodiscard]] inline bool sound(const Odometry& m) { return sound(m.pose.pose) && sound(m.twist.twist); }
[[nodiscard]] inline bool sound(const Imu& m) {
  return sound(m.angular_velocity) && sound(m.linear_acceleration);
}
[[nodiscard]] inline bool sound(const JointState& m) {
  return std::ranges::all_of(m.position, [](double x) { return std::isfinite(x); });
}
[[nodiscard]] inline bool sound(const RangeBearing& m) {
  return std::isfinite(m.range_m) && std::isfinite(m.bearing_rad);
}
[[nodiscard]] inline bool sound(const TagPoseArray& m) {
  return std::ranges::all_of(m.tags, [](const TagPose& tag) { return sound(tag.pose); });
}
[[nodiscard]] inline bool sound(const AprilTagDetectionArray& m) {
  return std::ranges::all_of(m.detections, [](const AprilTagDetection& tag) {
    return std::ranges::all_of(
        tag.corners, [](const AprilTagPoint& p) { return std::isfinite(p.x) && std::isfinite(p.y); });
  });
}
[[nodiscard]] inline bool sound(const TransformStamped& t) {
  return sound(t.translation) && sound(t.rotation);
}

}  // namespace waymark::ros2
