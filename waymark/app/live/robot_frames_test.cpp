#include "waymark/app/live/robot_frames.hpp"

#include <algorithm>

#include "tests/support/node_drive.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/config/share.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"

namespace waymark {
namespace {

using test::FakeBus;
using test::Network;
using FramesOfNode = test::Node;

BusMessage to_first(const Network& network, const std::string& topic,
                    const std::vector<std::uint8_t>& bytes) {
  const auto found = std::ranges::find(network.subscriptions, topic);
  return {static_cast<std::size_t>(found - network.subscriptions.begin()), bytes, {}, {}};
}

NodeRobot namespaced_robot() {
  NodeRobot robot{.profile = Ros2Profile{.odometry_topic = "/r1/odom", .camera_info_topic = "/r1/info"}};
  robot.cameras = {{.camera = read_robot(find_shared("robots", "limo").value())->camera,
                    .base_T_cam = SE3({}, {0.1, 0, 0.2})}};
  return robot;
}

ros2::CameraInfo camera_info(const std::string& frame) { return {.header = {{}, frame}}; }
ros2::Odometry odometry_of(const std::string& frame, const std::string& child) {
  ros2::Odometry message = ros2::to_ros(Odometry{});
  message.header.frame_id = frame;
  message.child_frame_id = child;
  return message;
}

TEST(RobotFramesTest, AreThoseOfTheRobotsMessagesAndOfItsProfile) {
  Network network;
  FakeBus bus(network);
  RobotFrames frames(namespaced_robot());
  ASSERT_TRUE(frames.join(bus));
  EXPECT_FALSE(frames.settled(steady_now())) << "the robot has not said them yet";
  EXPECT_FALSE(frames.take(bus, {99, {}, {}, {}}));
  EXPECT_TRUE(frames.take(
      bus, to_first(network, "rt/r1/odom", cdr::encode(odometry_of("r1/odom", "/r1/base_footprint")))));
  EXPECT_TRUE(frames.take(
      bus, to_first(network, "rt/r1/info", cdr::encode(camera_info("camera_color_optical_frame")))));
  EXPECT_TRUE(frames.settled(steady_now()));
  EXPECT_EQ(frames.odom(), "r1/odom");
  EXPECT_EQ(frames.base(), "r1/base_footprint");
  EXPECT_EQ(frames.camera("cam"), "camera_color_optical_frame");
  EXPECT_EQ(frames.camera("left"), "left_optical") << "another camera";

  NodeRobot named = namespaced_robot();
  named.profile->odom_frame = "wheels";
  named.profile->base_frame = "body";
  RobotFrames by_profile(std::move(named));
  ASSERT_TRUE(by_profile.join(bus));
  (void)by_profile.take(bus, {network.subscriptions.size() - 2, cdr::encode(odometry_of("o", "b")), {}, {}});
  EXPECT_EQ(by_profile.odom(), "wheels");
  EXPECT_EQ(by_profile.base(), "body");
}

TEST(RobotFramesTest, ACameraThatNoTransformJoinsToTheBaseIsMountedHere) {
  for (const bool in_tf : {true, false}) {
    Network network;
    FakeBus bus(network);
    RobotFrames frames(namespaced_robot());
    ASSERT_TRUE(frames.join(bus));
    (void)frames.take(bus, to_first(network, "rt/r1/odom", cdr::encode(odometry_of("o", "r1/base"))));
    if (in_tf)
      (void)frames.take(bus, to_first(network, "rt/tf_static",
                                      cdr::encode(ros2::TFMessage{{ros2::to_ros_transform(
                                          {}, "r1/base", "camera_optical", SE3())}})));
    const Duration began = std::chrono::seconds(100);
    EXPECT_FALSE(frames.mount(bus, "cam", began)) << "nothing came from the robot";
    frames.robot_speaks(began);
    EXPECT_FALSE(frames.mount(bus, "cam", began + std::chrono::milliseconds(2900))) << "it may still say it";
    const auto mounted = frames.mount(bus, "cam", began + std::chrono::seconds(3));
    ASSERT_EQ(mounted.has_value(), !in_tf);
    if (!mounted) continue;
    EXPECT_TRUE(frames.settled(began + std::chrono::seconds(3))) << "no camera_info ever came";
    ASSERT_EQ(mounted->transforms.size(), 1U);
    EXPECT_EQ(mounted->transforms[0].header.frame_id, "r1/base");
    EXPECT_EQ(mounted->transforms[0].child_frame_id, "camera_optical");
    EXPECT_EQ(mounted->transforms[0].translation.z, 0.2);
    EXPECT_FALSE(frames.mount(bus, "cam", began + std::chrono::seconds(4))) << "once";
  }
}

TEST_F(FramesOfNode, FramesAreThoseThatTheRobotUses) {
  node_.reset();
  {
    const std::scoped_lock lock(network_.mutex);
    network_.subscriptions.clear();
  }
  node_ = Ros2Node::start(std::make_unique<FakeBus>(network_), feed_, namespaced_robot()).value();
  request("rt/r1/odom", cdr::encode(odometry_of("r1/odom", "r1/base")));
  request("rt/r1/info", cdr::encode(camera_info("eye")));
  const SensorTime stamp(std::chrono::seconds(100));
  std::vector<std::vector<std::uint8_t>> tags;
  const Duration deadline = steady_now() + std::chrono::seconds(10);
  for (int i = 0; tags.empty() && steady_now() < deadline; ++i) {
    feed_.publish(Sample(Odometry{.stamp = stamp + std::chrono::milliseconds(i)}), 0);
    feed_.publish(ros2::PoseWithCovarianceStamped{.header = {ros2::to_ros(stamp), "map"}}, 0);
    feed_.publish(Sample(TagFrame{.stamp = stamp}), 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const std::scoped_lock lock(network_.mutex);
    tags = network_.sent["rt/waymark/tags"];
  }
  ASSERT_FALSE(tags.empty());
  EXPECT_EQ(cdr::decode<ros2::AprilTagDetectionArray>(tags[0])->header.frame_id, "eye");
  const auto frames = sent("rt/tf", 1);
  EXPECT_EQ(cdr::decode<ros2::TFMessage>(frames.at(0))->transforms[0].child_frame_id, "r1/odom");
}

}  // namespace
}  // namespace waymark
