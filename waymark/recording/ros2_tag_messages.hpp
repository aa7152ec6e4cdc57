#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/recording/ros2_geometry_messages.hpp"

/// apriltag_msgs, and waymark_msgs: what ROS 2 has no message for.
namespace waymark::ros2 {

struct AprilTagPoint {
  double x = 0, y = 0;
  WAYMARK_ROS2_FIELDS(self.x, self.y)
};

/// apriltag_ros fills corners as libapriltag orders them: BL, BR, TR, TL of the printed tag; pixel centres as
/// in ROS.
struct AprilTagDetection {
  std::string family{};
  std::int32_t id = 0;
  std::int32_t hamming = 0;
  float goodness = 0;
  float decision_margin = 0;
  AprilTagPoint centre{};
  std::array<AprilTagPoint, 4> corners{};
  std::array<double, 9> homography{};
  WAYMARK_ROS2_FIELDS(self.family, self.id, self.hamming, self.goodness, self.decision_margin, self.centre,
                      self.corners, self.homography)
};

struct AprilTagDetectionArray {
  static constexpr std::string_view kType = "apriltag_msgs/msg/AprilTagDetectionArray";
  Header header{};
  std::vector<AprilTagDetection> detections{};
  WAYMARK_ROS2_FIELDS(self.header, self.detections)
};

/// Ours: what apriltag_msgs has no room for. One entry a detection, in the order of the
/// AprilTagDetectionArray with the same stamp.
struct TagCornerCovariances {
  static constexpr std::string_view kType = "waymark_msgs/msg/TagCornerCovariances";
  Header header{};
  std::vector<std::int32_t> id{};
  std::vector<double> covariance_px2{};  ///< 64 numbers an entry: 8x8, corners TL TR BR BL as x y x y x y x y
  WAYMARK_ROS2_FIELDS(self.header, self.id, self.covariance_px2)
};

struct TagPose {
  std::string family{};
  std::int32_t id = 0;
  Pose pose{};  ///< of the tag in the camera: centre, x right, y down, z into the tag
  WAYMARK_ROS2_FIELDS(self.family, self.id, self.pose)
};

/// Ours: tags of one picture as poses in the camera, where nothing knows their corners.
struct TagPoseArray {
  static constexpr std::string_view kType = "waymark_msgs/msg/TagPoseArray";
  Header header{};
  std::vector<TagPose> tags{};
  WAYMARK_ROS2_FIELDS(self.header, self.tags)
};

/// Ours: distance and direction of a landmark with a number.
struct RangeBearing {
  static constexpr std::string_view kType = "waymark_msgs/msg/RangeBearing";
  Header header{};
  std::int64_t landmark = 0;
  double range_m = 0;
  double bearing_rad = 0;  ///< counter-clockwise from x of the frame in the header
  WAYMARK_ROS2_FIELDS(self.header, self.landmark, self.range_m, self.bearing_rad)
};

}  // namespace waymark::ros2
