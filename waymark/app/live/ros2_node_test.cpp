#include "waymark/app/live/ros2_node.hpp"

#include <algorithm>
#include <set>
#include <thread>

#include "tests/support/golden_page.hpp"
#include "tests/support/node_drive.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/robots/dds/ros_names.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

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

TEST(RobotFramesTest, AreReadFromMessagesAndProfile) {
  Network network;
  FakeBus bus(network);
  RobotFrames frames(namespaced_robot());
  ASSERT_TRUE(frames.join(bus));
  EXPECT_FALSE(frames.settled(steady_now())) << "no message with the names has arrived";
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

TEST(RobotFramesTest, PublishesTheMountingOfACameraWithoutTransformToTheBase) {
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
    EXPECT_FALSE(frames.mount(bus, "cam", began)) << "the robot has not started";
    frames.robot_started(began);
    EXPECT_FALSE(frames.mount(bus, "cam", began + std::chrono::milliseconds(2900)))
        << "a transform may still arrive";
    const auto mounted = frames.mount(bus, "cam", began + std::chrono::seconds(3));
    ASSERT_EQ(mounted.has_value(), !in_tf);
    if (!mounted) continue;
    EXPECT_TRUE(frames.settled(began + std::chrono::seconds(3))) << "no camera_info has arrived";
    ASSERT_EQ(mounted->transforms.size(), 1U);
    EXPECT_EQ(mounted->transforms[0].header.frame_id, "r1/base");
    EXPECT_EQ(mounted->transforms[0].child_frame_id, "camera_optical");
    EXPECT_EQ(mounted->transforms[0].translation.z, 0.2);
    EXPECT_FALSE(frames.mount(bus, "cam", began + std::chrono::seconds(4))) << "published only once";
  }
}

TEST_F(FramesOfNode, PublishesInTheFramesOfTheRobot) {
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

using test::Node;

TEST_F(Node, PublishesDiagnosticsWithTheClockOncePerSecond) {
  const SensorTime stamp(std::chrono::seconds(100));
  const Duration began = steady_now();
  const std::int64_t behind_ns = 250'000'000;
  TagFrame seen{.stamp = stamp, .detections = {{}, {.corner_state = CornerState::Unreliable}}};
  for (int i = 0; steady_now() - began < std::chrono::milliseconds(1500); ++i) {
    feed_.publish(Sample(Odometry{.stamp = stamp}), stamp.time_since_epoch().count() + behind_ns + i);
    if (i == 0) feed_.publish(Sample(seen), 0);
    feed_.set_status({.phase = "replaying", .driven_m = 0.01 * i});
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const auto all = sent("rt/diagnostics", 2);
  EXPECT_LE(all.size(), 4U) << "first status, phase change, one per second";
  const auto newest = cdr::decode<ros2::DiagnosticArray>(all.back());
  ASSERT_TRUE(newest);
  const auto& values = newest->status[0].values;
  const auto value_of = [&](const char* key) {
    const auto found = std::ranges::find_if(values, [&](const auto& one) { return one.key == key; });
    return found == values.end() ? "missing" : found->value;
  };
  EXPECT_EQ(value_of("robot_clock_behind_s"), "0.250");
  EXPECT_EQ(value_of("unreliable_tags"), "1");
}

TEST_F(Node, MapToOdomAndOdometryGiveTheEstimatedPose) {
  const SensorTime stamp(std::chrono::seconds(100));
  const SE2 odom_T_base(1, 2, 0.5);
  const SE2 map_T_base(4, -1, -0.25);
  feed_.publish(Sample(Odometry{.stamp = stamp, .odom_T_base = odom_T_base}), 0);
  feed_.publish(Sample(Odometry{.stamp = stamp + std::chrono::milliseconds(20), .odom_T_base = SE2(9, 9, 0)}),
                0);
  ros2::PoseWithCovarianceStamped estimate{.header = {ros2::to_ros(stamp), "map"}};
  estimate.pose.pose = ros2::to_ros(lift(map_T_base));
  feed_.publish(estimate, 0);
  const auto frames = sent("rt/tf", 1);
  ASSERT_EQ(frames.size(), 1U);
  const auto message = cdr::decode<ros2::TFMessage>(frames[0]);
  ASSERT_TRUE(message && message->transforms.size() == 1);
  EXPECT_EQ(message->transforms[0].header.frame_id, "map");
  EXPECT_EQ(message->transforms[0].child_frame_id, "odom");
  const SE3 map_T_odom = ros2::from_ros(message->transforms[0]);
  EXPECT_TRUE((map_T_odom * lift(odom_T_base)).matrix().isApprox(lift(map_T_base).matrix(), 1e-12))
      << "uses the odometry at the timestamp of the estimate, not a later one";
  EXPECT_EQ(sent("rt/waymark/pose", 1).size(), 1U);
}

TEST_F(Node, ServicesAnswerClientsOfBothKindsAndPressButtons) {
  feed_.set_status({.phase = "idle"});
  ASSERT_FALSE(sent("rt/diagnostics", 1).empty());
  const std::vector<std::uint8_t> plain = {0, 1, 0, 0, 0};  // rmw_fastrtps adds only a padding byte
  RequestIdentity client{.sequence = 7};
  client.guid[3] = 9;
  request("rq/waymark/pauseRequest", plain, client);
  auto replies = sent("rr/waymark/pauseReply", 1);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0][4], 0) << "no success in this phase";
  ASSERT_EQ(network_.answered.size(), 1U);
  EXPECT_EQ(network_.answered[0].sequence, 7);
  EXPECT_EQ(network_.answered[0].guid, client.guid);
  EXPECT_TRUE(feed_.take_orders().empty());

  std::vector<std::uint8_t> headed = {0, 1, 0, 0};  // rmw_cyclonedds puts a 16-byte header in front
  for (std::uint8_t i = 0; i < 17; ++i) headed.push_back(i);
  request("rq/waymark/start_teachRequest", headed);
  replies = sent("rr/waymark/start_teachReply", 1);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_TRUE(std::equal(headed.begin(), headed.begin() + 20, replies[0].begin()))
      << "the header is returned";
  EXPECT_EQ(replies[0][20], 1) << "success";
  const auto orders = feed_.take_orders();
  ASSERT_EQ(orders.size(), 1U);
  EXPECT_EQ(orders[0].kind, ViewerOrder::Kind::Teach);
}

TEST_F(Node, PassesOnInitialPosesAndCountsRejectedOnes) {
  ros2::PoseWithCovarianceStamped message{.header = {{}, "odom"}};
  message.pose.pose = ros2::to_ros(lift(SE2(1, 2, 0.5)));
  message.pose.covariance[0] = message.pose.covariance[7] = message.pose.covariance[35] = 0.04;
  const auto counted = [&] {
    const auto all = sent("rt/diagnostics", 1);
    return cdr::decode<ros2::DiagnosticArray>(all.back())->status[0].values.back();
  };
  EXPECT_EQ(counted().value, "0");
  request("rt/initialpose", cdr::encode(message));
  std::vector<ViewerOrder> orders;
  const Duration deadline = steady_now() + std::chrono::seconds(10);
  while (orders.empty() && steady_now() < deadline) orders = feed_.take_orders();
  ASSERT_EQ(orders.size(), 1U);
  EXPECT_EQ(orders[0].kind, ViewerOrder::Kind::Message);
  EXPECT_NE(orders[0].message.find("'odom'"), std::string::npos);
  testing::expect_on_page("live", orders[0].message);
  while (counted().value == "0" && steady_now() < deadline) {
  }
  EXPECT_EQ(counted().key, "refused_initial_poses");
  EXPECT_EQ(counted().value, "1");
  message.header.frame_id = "map";
  request("rt/initialpose", cdr::encode(message));
  for (orders.clear(); orders.empty() && steady_now() < deadline;) orders = feed_.take_orders();
  ASSERT_EQ(orders.size(), 1U);
  EXPECT_EQ(orders[0].kind, ViewerOrder::Kind::GivePose);
  EXPECT_NEAR(orders[0].pose.map_T_base.yaw(), 0.5, 1e-12);
}

TEST_F(Node, PublishesImagesWithTagsToSubscribers) {
  const SensorTime stamp(std::chrono::seconds(100));
  feed_.publish(Sample(CameraFrame{.stamp = stamp, .camera = "front", .image = Image(64, 48)}), 0);
  feed_.publish(Sample(TagFrame{.stamp = stamp + std::chrono::seconds(1), .camera = "front"}),
                0);  // these tags belong to another image
  TagDetection tag;
  tag.corners_px = {{{10, 10}, {30, 10}, {30, 30}, {10, 30}}};
  feed_.publish(Sample(TagFrame{.stamp = stamp, .camera = "front", .detections = {tag}}), 0);
  const auto shown = sent("rt/waymark/image/compressed", 1);
  ASSERT_EQ(shown.size(), 1U);
  const auto message = cdr::decode<ros2::CompressedImage>(shown[0]);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->header.frame_id, "front_optical");
  EXPECT_EQ(ros2::from_ros(message->header.stamp), stamp);
  EXPECT_EQ(message->format, "jpeg");
  const auto image = decode_image(message->data, "image");
  ASSERT_TRUE(image) << to_string(image.error());
  EXPECT_EQ(image->width(), 64);
  EXPECT_GT(image->view().at(20, 10), 20) << "the edge of the tag, on black";
}

TEST(Ros2Services, StopActsInEveryPhaseAndOtherServicesOnlyInTheirs) {
  for (const char* phase :
       {"", "idle", "teaching", "mapping", "ready", "replaying", "paused", "done", "stopped"}) {
    EXPECT_EQ(button_of_service("stop", phase).press, ViewerOrder::Kind::Stop) << phase;
    const bool stationary = std::set<std::string>{"idle", "ready", "done", "stopped"}.contains(phase);
    EXPECT_EQ(button_of_service("start_teach", phase).press,
              stationary ? std::optional(ViewerOrder::Kind::Teach) : std::nullopt)
        << phase;
    EXPECT_EQ(button_of_service("map", phase).press.has_value(), phase == std::string("teaching")) << phase;
    EXPECT_EQ(button_of_service("pause", phase).press.has_value(), phase == std::string("replaying"))
        << phase;
  }
  EXPECT_FALSE(button_of_service("replay", "replaying").press) << "it would pause";
  EXPECT_TRUE(button_of_service("replay", "paused").press);
}

TEST(Ros2Services, MessagesNameTheServiceThatActsInThePhase) {
  using S = OperatorState;
  const ViewerLabels words = service_labels();
  EXPECT_NE(words.alone.find("/waymark/start_teach, "), std::string::npos) << words.alone;
  const std::pair<S, const char*> buttons[] = {
      {S::Idle, "/waymark/start_teach"}, {S::Teaching, "/waymark/map"},  {S::Ready, "/waymark/replay"},
      {S::Replaying, "/waymark/pause"},  {S::Paused, "/waymark/replay"}, {S::Stopped, "/waymark/replay"}};
  for (const auto& [state, service] : buttons) EXPECT_EQ(words.buttons(state).go, service);
}

}  // namespace
}  // namespace waymark
