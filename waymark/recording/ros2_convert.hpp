#pragma once

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/recording/ros2_messages.hpp"
#include "waymark/samples/robot_samples.hpp"

/// Between our samples and ROS 2 messages. This is the border where conventions change: pixel centres (+1/2
/// here, integers there), corner order (TL TR BR BL here; BL BR TR TL there), frame names (base_link,
/// camera_optical, tag36h11:7).
namespace waymark::ros2 {

inline constexpr std::string_view kMapFrame = "map";
inline constexpr std::string_view kOdomFrame = "odom";
inline constexpr std::string_view kBaseFrame = "base_link";
inline constexpr std::string_view kCameraFrame = "camera_optical";

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
/// Fails without the joints left_wheel and right_wheel.
[[nodiscard]] Result<WheelTicks> from_ros(const JointState& message);
[[nodiscard]] Imu to_ros(const ImuSample& imu);
[[nodiscard]] ImuSample from_ros(const Imu& message);
[[nodiscard]] TwistStamped to_ros(const StampedCommand& command);
[[nodiscard]] StampedCommand from_ros(const TwistStamped& message);
[[nodiscard]] PoseStamped to_ros(const TruthPose& truth);

[[nodiscard]] AprilTagDetectionArray to_ros(const TagFrame& frame);
[[nodiscard]] TagCornerCovariances covariances_to_ros(const TagFrame& frame);
/// Fails on a family that is not known. Covariances come on a topic of their own: see add_covariances().
[[nodiscard]] Result<TagFrame> from_ros(const AprilTagDetectionArray& message);
/// Fails when the entries are not those of the frame.
[[nodiscard]] Status add_covariances(TagFrame& frame, const TagCornerCovariances& message);

[[nodiscard]] CameraInfo to_ros(const CameraModel& camera, SensorTime stamp);
/// Fails on a distortion model that is not known and on what CameraModel::make() refuses.
[[nodiscard]] Result<CameraModel> from_ros(const CameraInfo& message);

}  // namespace waymark::ros2
