#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/samples/robot_samples.hpp"

/// Detections from TagSLAM bags (berndpfrommer/apriltag_msgs) that were converted from ROS 1.
namespace waymark::ros2 {

/// Corners are BL, BR, TR, TL of the printed tag, with pixel centres as in ROS. The family is "", "mit" or a
/// name.
struct Apriltag {
  std::int32_t id = 0;
  std::string family{};
  std::int32_t hamming = 0;
  std::int32_t border = 0;
  std::int32_t bits = 0;
  Point center{};
  std::array<Point, 4> corners{};
  WAYMARK_ROS2_FIELDS(self.id, self.family, self.hamming, self.border, self.bits, self.center, self.corners)
};

struct ApriltagArrayStamped {
  static constexpr std::string_view kType = "apriltag_msgs/msg/ApriltagArrayStamped";
  Header header{};
  std::vector<Apriltag> apriltags{};
  WAYMARK_ROS2_FIELDS(self.header, self.apriltags)
};

/// Families "" and "mit" are tag36h11, the only family these detectors supported. Fails on an unknown family.
[[nodiscard]] Result<TagFrame> from_ros(const ApriltagArrayStamped& message);

}  // namespace waymark::ros2

/// Converts between samples and ROS 2 messages, which use different conventions. Pixel centres are at +1/2 in
/// samples and at integers in ROS. The corner order is TL TR BR BL in samples and BL BR TR TL in ROS. Frame
/// names are base_link, camera_optical and tag36h11:7.
namespace waymark::ros2 {

inline constexpr std::string_view kMapFrame = "map";
inline constexpr std::string_view kOdomFrame = "odom";
inline constexpr std::string_view kBaseFrame = "base_link";
inline constexpr std::string_view kCameraFrame = "camera_optical";
inline constexpr std::string_view kLaserFrame = "laser";

/// Frame of a camera in messages: camera_optical for "cam", left_optical for "left". camera_of_frame() is the
/// inverse. It returns "cam" for an empty frame; a frame that does not end in _optical is returned unchanged.
[[nodiscard]] std::string camera_frame(std::string_view camera);
[[nodiscard]] std::string camera_of_frame(std::string_view frame);

[[nodiscard]] Time to_ros(SensorTime stamp);
[[nodiscard]] SensorTime from_ros(const Time& stamp);
[[nodiscard]] Pose to_ros(const SE3& a_T_b);
[[nodiscard]] SE3 from_ros(const Pose& pose);
[[nodiscard]] TransformStamped to_ros_transform(SensorTime stamp, std::string_view parent,
                                                std::string_view child, const SE3& parent_T_child);
[[nodiscard]] SE3 from_ros(const TransformStamped& transform);

[[nodiscard]] Odometry to_ros(const waymark::Odometry& odometry);
[[nodiscard]] waymark::Odometry from_ros(const Odometry& message);
[[nodiscard]] JointState to_ros(const WheelTicks& ticks);
/// Uses the first joints with the names of a left and a right wheel; fails if there are none.
[[nodiscard]] Result<WheelTicks> from_ros(const JointState& message);
[[nodiscard]] Imu to_ros(const ImuSample& imu);
[[nodiscard]] ImuSample from_ros(const Imu& message);
[[nodiscard]] TwistStamped to_ros(const StampedCommand& command);
[[nodiscard]] StampedCommand from_ros(const TwistStamped& message);
[[nodiscard]] PoseStamped to_ros(const TruthPose& truth);

/// Only the tags with usable corners; the others are in unreliable_to_ros().
[[nodiscard]] AprilTagDetectionArray to_ros(const TagFrame& frame);
[[nodiscard]] TagCornerCovariances covariances_to_ros(const TagFrame& frame);
[[nodiscard]] UnreliableTags unreliable_to_ros(const TagFrame& frame);
/// Fails on an unknown family. Covariances are on a separate topic: see add_covariances().
[[nodiscard]] Result<TagFrame> from_ros(const AprilTagDetectionArray& message);
/// Fails unless the entries match the detections of the frame.
[[nodiscard]] Status add_covariances(TagFrame& frame, const TagCornerCovariances& message);
/// Inserts the unreliable tags into a frame with all others. Fails on an unknown family and if the positions
/// do not match the frame.
[[nodiscard]] Status add_unreliable(TagFrame& frame, const UnreliableTags& message);

/// The encoding is mono8.
[[nodiscard]] Image to_ros(const CameraFrame& frame);
/// Converts to a grey image as grey_of() does. Fails on encodings that grey_of() does not support and if the
/// size does not match the data.
[[nodiscard]] Result<CameraFrame> from_ros(const Image& message);
/// Decodes JPEG, PNG or PNM, whatever `format` is; fails like decode_image().
[[nodiscard]] Result<CameraFrame> from_ros(const CompressedImage& message);

/// ROS stores angles and limits as float32, with a relative error up to 1e-7.
[[nodiscard]] LaserScan to_ros(const waymark::LaserScan& scan);
[[nodiscard]] waymark::LaserScan from_ros(const LaserScan& message);
[[nodiscard]] Joy to_ros(const GamepadState& state);
[[nodiscard]] GamepadState from_ros(const Joy& message);
[[nodiscard]] RangeBearing to_ros(const waymark::RangeBearing& sample);
[[nodiscard]] waymark::RangeBearing from_ros(const RangeBearing& message);
[[nodiscard]] TagPoseArray to_ros(const TagPoseFrame& frame);
/// Fails on an unknown family.
[[nodiscard]] Result<TagPoseFrame> from_ros(const TagPoseArray& message);

[[nodiscard]] CameraInfo to_ros(const CameraModel& camera, SensorTime stamp, std::string_view name = "cam");
/// The camera for the images that are sent, after region of interest and binning. Fails in the same cases as
/// camera_from().
[[nodiscard]] Result<CameraModel> from_ros(const CameraInfo& message);
/// The camera for rectified images of the same part: the projection matrix, without distortion.
[[nodiscard]] Result<CameraModel> rectified_from_ros(const CameraInfo& message);

// Whether the values in a message are valid for a robot.
[[nodiscard]] inline bool sound(const Vector3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
/// Whether it is finite, with a norm close enough to 1 for a rotation.
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
[[nodiscard]] inline bool sound(const AprilTagDetection& tag) {
  return std::ranges::all_of(tag.corners,
                             [](const AprilTagPoint& p) { return std::isfinite(p.x) && std::isfinite(p.y); });
}
[[nodiscard]] inline bool sound(const AprilTagDetectionArray& m) {
  return std::ranges::all_of(m.detections, [](const AprilTagDetection& tag) { return sound(tag); });
}
[[nodiscard]] inline bool sound(const UnreliableTags& m) {
  return std::ranges::all_of(m.detections, [](const AprilTagDetection& tag) { return sound(tag); });
}
[[nodiscard]] inline bool sound(const TransformStamped& t) {
  return sound(t.translation) && sound(t.rotation);
}

}  // namespace waymark::ros2
