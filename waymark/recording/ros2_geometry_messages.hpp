#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/recording/ros2_fields.hpp"

/// std_msgs, geometry_msgs, nav_msgs and tf2_msgs.
namespace waymark::ros2 {

struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  WAYMARK_ROS2_FIELDS(self.sec, self.nanosec)
};

struct Header {
  Time stamp{};
  std::string frame_id{};
  WAYMARK_ROS2_FIELDS(self.stamp, self.frame_id)
};

struct Vector3 {
  double x = 0, y = 0, z = 0;
  WAYMARK_ROS2_FIELDS(self.x, self.y, self.z)
};
using Point = Vector3;

struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
  WAYMARK_ROS2_FIELDS(self.x, self.y, self.z, self.w)
};

struct Pose {
  Point position{};
  Quaternion orientation{};
  WAYMARK_ROS2_FIELDS(self.position, self.orientation)
};

struct PoseWithCovariance {
  Pose pose{};
  std::array<double, 36> covariance{};  ///< row-major; x y z, then rotation about fixed x y z
  WAYMARK_ROS2_FIELDS(self.pose, self.covariance)
};

struct Twist {
  static constexpr std::string_view kType = "geometry_msgs/msg/Twist";
  Vector3 linear{};   ///< [m/s]
  Vector3 angular{};  ///< [rad/s]
  WAYMARK_ROS2_FIELDS(self.linear, self.angular)
};

struct TwistWithCovariance {
  Twist twist{};
  std::array<double, 36> covariance{};
  WAYMARK_ROS2_FIELDS(self.twist, self.covariance)
};

struct TwistStamped {
  static constexpr std::string_view kType = "geometry_msgs/msg/TwistStamped";
  Header header{};
  Twist twist{};
  WAYMARK_ROS2_FIELDS(self.header, self.twist)
};

struct PoseStamped {
  static constexpr std::string_view kType = "geometry_msgs/msg/PoseStamped";
  Header header{};
  Pose pose{};
  WAYMARK_ROS2_FIELDS(self.header, self.pose)
};

struct PoseWithCovarianceStamped {
  static constexpr std::string_view kType = "geometry_msgs/msg/PoseWithCovarianceStamped";
  Header header{};
  PoseWithCovariance pose{};
  WAYMARK_ROS2_FIELDS(self.header, self.pose)
};

struct Odometry {
  static constexpr std::string_view kType = "nav_msgs/msg/Odometry";
  Header header{};
  std::string child_frame_id{};
  PoseWithCovariance pose{};
  TwistWithCovariance twist{};
  WAYMARK_ROS2_FIELDS(self.header, self.child_frame_id, self.pose, self.twist)
};

struct Path {
  static constexpr std::string_view kType = "nav_msgs/msg/Path";
  Header header{};
  std::vector<PoseStamped> poses{};
  WAYMARK_ROS2_FIELDS(self.header, self.poses)
};

struct TransformStamped {
  Header header{};
  std::string child_frame_id{};
  Vector3 translation{};
  Quaternion rotation{};
  WAYMARK_ROS2_FIELDS(self.header, self.child_frame_id, self.translation, self.rotation)
};

struct TFMessage {
  static constexpr std::string_view kType = "tf2_msgs/msg/TFMessage";
  std::vector<TransformStamped> transforms{};
  WAYMARK_ROS2_FIELDS(self.transforms)
};

}  // namespace waymark::ros2
