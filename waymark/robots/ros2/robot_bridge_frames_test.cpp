// Which frames a bridge takes for base and camera, and what it says of them.
#include <gtest/gtest.h>

#include "tests/support/robot_lines.hpp"
#include "waymark/config/share.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/robots/ros2/robot_bridge.hpp"

namespace waymark {
namespace {

SensorTime stamp_ms(int ms) { return SensorTime(std::chrono::seconds(1000) + std::chrono::milliseconds(ms)); }

RobotDescription limo_file() { return read_robot(find_shared("robots", "limo").value()).value(); }

template <class Message>
void send(RobotBridge& bridge, const std::string& topic, const Message& message) {
  (void)bridge.receive({topic, std::string(Message::kType), {}}, cdr::encode(message),
                       std::chrono::milliseconds(20));
}

TEST(BridgeFrames, OfANamespacedRobotTakeTheBaseOfItsOdometryWhereTheProfileNamesNone) {
  Ros2Profile profile = find_ros2_profile("limo").value();
  profile.base_frame.clear();
  RobotBridge bridge(profile, limo_file());
  ros2::Odometry odometry = ros2::to_ros(Odometry{.stamp = stamp_ms(0)});
  odometry.child_frame_id = "r1/base_footprint";
  send(bridge, "/odom", odometry);
  ros2::Image picture = ros2::to_ros(CameraFrame{.stamp = stamp_ms(10), .image = Image(64, 48)});
  picture.header.frame_id = "r1/eye";
  send(bridge, "/camera/color/image_raw", picture);
  const ros2::TFMessage tf{
      {ros2::to_ros_transform(stamp_ms(0), "r1/base_footprint", "r1/eye", SE3({}, {5, 0, 0}))}};
  send(bridge, "/tf_static", tf);
  EXPECT_NE(test::words_of(bridge).find("tf mounts the camera"), std::string::npos);
}

TEST(BridgeFrames, ACircleOfTransformsIsNoMounting) {
  RobotBridge bridge(find_ros2_profile("limo").value(), limo_file());
  send(bridge, "/odom", ros2::to_ros(Odometry{.stamp = stamp_ms(0)}));
  ros2::Image picture = ros2::to_ros(CameraFrame{.stamp = stamp_ms(10), .image = Image(64, 48)});
  picture.header.frame_id = "camera_color_optical_frame";
  send(bridge, "/camera/color/image_raw", picture);
  ros2::TFMessage circle{{ros2::to_ros_transform(stamp_ms(0), "base_link", "mast", SE3({}, {0, 0, 0.5})),
                          ros2::to_ros_transform(stamp_ms(0), "mast", "camera_color_optical_frame", SE3())}};
  circle.transforms.push_back(
      ros2::to_ros_transform(stamp_ms(0), "camera_color_optical_frame", "base_link", SE3({}, {1, 2, 3})));
  send(bridge, "/tf_static", circle);
  const std::string said = test::words_of(bridge);
  EXPECT_EQ(said.find("tf mounts the camera"), std::string::npos) << said;
  EXPECT_NE(said.find("go round in a circle: "), std::string::npos) << said;
}

}  // namespace
}  // namespace waymark
