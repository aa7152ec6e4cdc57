#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/recording/ros2_fields.hpp"
#include "waymark/recording/ros2_geometry_messages.hpp"
#include "waymark/samples/robot_samples.hpp"

/// The detections of the bags TagSLAM reads (berndpfrommer/apriltag_msgs), as the transcoder of ROS 1 gives
/// them.
namespace waymark::ros2 {

/// Corners: BL, BR, TR, TL of the printed tag; pixel centres as in ROS. The family is "", "mit" or a name.
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

/// Families "" and "mit" are tag36h11, the only one these detectors were used with. Fails on one not known.
[[nodiscard]] Result<TagFrame> from_ros(const ApriltagArrayStamped& message);

}  // namespace waymark::ros2
