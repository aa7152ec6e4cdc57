#include "waymark/recording/ros2/messages.hpp"

#include <gtest/gtest.h>

namespace waymark::ros2 {
namespace {

TEST(Ros2Schemas, CarryEveryTypeTheyUseOnce) {
  const std::string text = schema_text(Odometry::kType);
  EXPECT_TRUE(text.starts_with("std_msgs/Header header\nstring child_frame_id\n"));
  for (const std::string used :
       {"std_msgs/Header", "builtin_interfaces/Time", "geometry_msgs/PoseWithCovariance",
        "geometry_msgs/Pose", "geometry_msgs/Point", "geometry_msgs/Quaternion",
        "geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist", "geometry_msgs/Vector3"}) {
    const std::string line = "MSG: " + used + "\n";
    const std::size_t at = text.find(line);
    ASSERT_NE(at, std::string::npos) << used;
    EXPECT_EQ(text.find(line, at + 1), std::string::npos) << used << " appears twice";
  }
}

TEST(Ros2Schemas, EveryRecordedTypeHasASchema) {
  for (const auto type : {Twist::kType,
                          TwistStamped::kType,
                          PoseStamped::kType,
                          PoseWithCovarianceStamped::kType,
                          Odometry::kType,
                          Imu::kType,
                          JointState::kType,
                          CameraInfo::kType,
                          TFMessage::kType,
                          AprilTagDetectionArray::kType,
                          DiagnosticArray::kType,
                          Image::kType,
                          CompressedImage::kType,
                          LaserScan::kType,
                          Joy::kType,
                          Path::kType,
                          MarkerArray::kType,
                          TagPoseArray::kType,
                          TagCornerCovariances::kType,
                          UnreliableTags::kType,
                          RangeBearing::kType}) {
    EXPECT_FALSE(schema_text(type).empty()) << type;
  }
  EXPECT_TRUE(schema_text("pkg/msg/Unknown").empty());
  EXPECT_TRUE(schema_text("nonsense").empty());
}

}  // namespace
}  // namespace waymark::ros2
