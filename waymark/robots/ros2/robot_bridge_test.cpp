#include "waymark/robots/ros2/robot_bridge.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/robot_lines.hpp"
#include "waymark/base/random.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/config/share.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/robots/ros2/topic_tools.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;

SensorTime at_ms(int ms) { return SensorTime(std::chrono::seconds(1000) + milliseconds(ms)); }

RobotDescription limo() { return read_robot(find_shared("robots", "limo").value()).value(); }

/// A bridge that uses the LIMO profile, and a reader for its lines.
class Bridge : public ::testing::Test {
 protected:
  template <class Message>
  std::vector<std::string> give(const std::string& topic, const Message& message, Duration arrived) {
    const Ros2Subscription from{topic, std::string(Message::kType), {}};
    return bridge_.receive(from, cdr::encode(message), arrived);
  }
  std::vector<std::string> odometry(int ms, double x_m = 0) {
    return give("/odom", ros2::to_ros(Odometry{.stamp = at_ms(ms), .odom_T_base = SE2(x_m, 0, 0)}),
                milliseconds(ms));
  }
  Sample read(const std::string& line) { return lines_.read(line); }
  std::string words() { return test::reports_of(bridge_); }

  RobotBridge bridge_{find_ros2_profile("limo").value(), limo()};
  test::RobotLines lines_;
};

// A simulation running at a quarter of real time.
TEST(BridgeOfASimulation, UsesItsClock) {
  Ros2Profile profile = find_ros2_profile("limo").value();
  profile.use_sim_time = true;
  RobotBridge bridge(profile, limo());
  const auto give = [&](const std::string& topic, const auto& message, int arrived_ms) {
    using Message = std::decay_t<decltype(message)>;
    return bridge.receive({topic, std::string(Message::kType), {}}, cdr::encode(message),
                          milliseconds(arrived_ms));
  };
  const auto odometry = [&](int ms, int arrived_ms) {
    return give("/odom", ros2::to_ros(Odometry{.stamp = at_ms(ms)}), arrived_ms);
  };
  EXPECT_TRUE(odometry(0, 0).empty()) << "before the clock message";
  for (int i = 0; i < 40; ++i) {
    EXPECT_TRUE(give("/clock", ClockMessage{ros2::to_ros(at_ms(100 * i))}, 400 * i).empty());
    EXPECT_EQ(odometry(100 * i, 400 * i).size(), 1U) << i << ": 12 s late by wall time";
  }
  EXPECT_EQ(bridge.simulated_time(), at_ms(3900));
  EXPECT_EQ(bridge.dropped(), 0U);
  EXPECT_TRUE(odometry(6000, 15700).empty()) << "in the future";
  EXPECT_TRUE(give("/clock", ClockMessage{ros2::to_ros(at_ms(0))}, 16000).empty());
  EXPECT_EQ(bridge.simulated_time(), at_ms(3900)) << "after a restart, the time does not go back";
  std::string reports;
  for (const std::string& line : bridge.take_reports()) reports += line;
  EXPECT_NE(reports.find("2.1 s in the future"), std::string::npos) << reports;
  EXPECT_NE(reports.find("3.900 s"), std::string::npos) << reports;
  testing::expect_on_page("robots", reports);
}

/// Transforms from a robot_state_publisher that publishes every joint on /tf.
ros2::TFMessage mast(double height_m) {
  return {{ros2::to_ros_transform(at_ms(0), "base_link", "mast", SE3({}, {0, 0, height_m})),
           ros2::to_ros_transform(at_ms(0), "mast", "camera_color_optical_frame", SE3())}};
}

TEST_F(Bridge, ComparesARepeatedMountingAndReportsOneThatMoves) {
  (void)odometry(0);
  ros2::Image image = ros2::to_ros(CameraFrame{.stamp = at_ms(10), .image = Image(64, 48)});
  image.header.frame_id = "camera_color_optical_frame";
  (void)give("/camera/color/image_raw", image, milliseconds(10));
  for (int i = 0; i < 3; ++i) (void)give("/tf", mast(0.5), milliseconds(20 + i));
  const std::string fixed = words();
  EXPECT_NE(fixed.find(" mm and "), std::string::npos) << fixed;
  EXPECT_EQ(fixed.find("moves"), std::string::npos) << fixed;
  (void)give("/tf", mast(0.6), milliseconds(30));
  const std::string moving = words();
  testing::expect_on_page("robots", moving);
  EXPECT_NE(moving.find("moves"), std::string::npos) << moving;
}

TEST_F(Bridge, OdometryAndImagesRoundTrip) {
  const auto lines = odometry(0, 1.5);
  ASSERT_EQ(lines.size(), 1U);
  const auto odometry = std::get<Odometry>(read(lines[0]));
  EXPECT_EQ(odometry.stamp, at_ms(0));
  EXPECT_DOUBLE_EQ(odometry.odom_T_base.x(), 1.5);
  CameraFrame frame{.stamp = at_ms(10), .camera = "cam", .image = Image(64, 48)};
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) frame.image.row(y)[x] = static_cast<std::uint8_t>(3 * x + 5 * y);
  const auto raw = give("/camera/color/image_raw", ros2::to_ros(frame), milliseconds(12));
  ASSERT_EQ(raw.size(), 1U);
  const auto back = std::get<CameraFrame>(read(raw[0]));
  EXPECT_EQ(back.stamp, frame.stamp);
  ASSERT_EQ(back.image.width(), 64);
  for (int y = 0; y < 48; ++y)
    EXPECT_TRUE(std::equal(back.image.row(y), back.image.row(y) + 64, frame.image.row(y)));
}

TEST_F(Bridge, ForwardsCompressedImagesUnchanged) {
  (void)odometry(0);
  const Image image(32, 24);
  const auto jpeg = encode_jpeg(image, 90).value();
  ros2::CompressedImage message{.header = {ros2::to_ros(at_ms(5)), "camera_color_optical_frame"},
                                .format = "jpeg"};
  message.data = jpeg;
  const auto lines = give("/camera/color/image_raw/compressed", message, milliseconds(6));
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(std::get<CameraFrame>(read(lines[0])).image.width(), 32);
  message.data.resize(3);
  EXPECT_TRUE(give("/camera/color/image_raw/compressed", message, milliseconds(7)).empty());
  EXPECT_EQ(bridge_.dropped(), 1U);
}

TEST_F(Bridge, DropsAndCountsMisleadingMessages) {
  ASSERT_EQ(odometry(0).size(), 1U);
  ros2::Odometry bad = ros2::to_ros(Odometry{.stamp = at_ms(20)});
  bad.pose.pose.position.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(give("/odom", bad, milliseconds(20)).empty()) << "not a number";
  bad.pose.pose.position.x = 1e300;
  EXPECT_TRUE(give("/odom", bad, milliseconds(20)).empty()) << "implausible position";
  EXPECT_TRUE(give("/odom", ros2::to_ros(Odometry{.stamp = at_ms(5000)}), milliseconds(20)).empty())
      << "in the future";
  EXPECT_TRUE(give("/odom", ros2::to_ros(Odometry{}), milliseconds(20)).empty()) << "without a timestamp";
  EXPECT_EQ(odometry(30).size(), 1U) << "dropped messages have no effect";
  EXPECT_TRUE(give("/odom", ros2::to_ros(Odometry{.stamp = at_ms(10)}), milliseconds(31)).empty())
      << "goes back";
  EXPECT_EQ(bridge_.dropped(), 5U);
  const std::string reports = words();
  EXPECT_NE(reports.find("0.020 s"), std::string::npos) << reports;
  testing::expect_on_page("robots", reports);
  ros2::Imu imu = ros2::to_ros(ImuSample{.stamp = SensorTime(std::chrono::seconds(77))});
  EXPECT_TRUE(give("/imu", imu, milliseconds(40)).empty()) << "a different clock";
}

TEST_F(Bridge, DropsHostileImagesAndEncapsulations) {
  (void)odometry(0);
  ros2::Image image{.header = {ros2::to_ros(at_ms(1)), "cam"},
                    .height = 4000,
                    .width = 4000,
                    .encoding = "mono8",
                    .step = 1};
  image.data.resize(16);
  EXPECT_TRUE(give("/camera/color/image_raw", image, milliseconds(1)).empty())
      << "the step is smaller than the width";
  image.step = 0xffffffffU;
  image.height = 0xffffffffU;
  EXPECT_TRUE(give("/camera/color/image_raw", image, milliseconds(1)).empty());
  auto bytes = cdr::encode(ros2::to_ros(Odometry{.stamp = at_ms(9)}));
  for (const int kind : {0, 2, 3, 6, 7, 10, 255}) {
    bytes[1] = static_cast<std::uint8_t>(kind);
    EXPECT_TRUE(
        bridge_.receive({"/odom", std::string(ros2::Odometry::kType), {}}, bytes, milliseconds(9)).empty());
  }
  EXPECT_EQ(bridge_.dropped(), 9U);
}

TEST_F(Bridge, DamagedMessagesGiveValidLinesOrNone) {
  (void)odometry(0);
  const auto all = subscriptions_of(find_ros2_profile("limo-sim").value());
  Random random(20261123);
  const auto byte = [&] { return static_cast<std::uint8_t>(random.uniform() * 256); };
  ros2::TFMessage loop;
  loop.transforms = {ros2::to_ros_transform(at_ms(0), "a", "b", SE3()),
                     ros2::to_ros_transform(at_ms(0), "b", "a", SE3())};
  const std::vector<std::vector<std::uint8_t>> seeds = {
      cdr::encode(ros2::to_ros(Odometry{.stamp = at_ms(1)})),
      cdr::encode(ros2::to_ros(ImuSample{.stamp = at_ms(1)})),
      cdr::encode(ros2::to_ros(CameraFrame{.stamp = at_ms(1), .image = Image(8, 8)})),
      cdr::encode(loop),
      cdr::encode(ros2::to_ros(limo().camera, at_ms(1))),
      cdr::encode(ros2::to_ros(WheelTicks{.stamp = at_ms(1)}))};
  int passed = 0;
  for (int i = 0; i < 20000; ++i) {
    auto bytes = seeds[static_cast<std::size_t>(i) % seeds.size()];
    for (int k = 0; k < 4; ++k)
      bytes[static_cast<std::size_t>(random.uniform() * static_cast<double>(bytes.size()))] = byte();
    if (i % 3 == 0)
      bytes.resize(static_cast<std::size_t>(random.uniform() * static_cast<double>(bytes.size())));
    const auto& from = all[static_cast<std::size_t>(random.uniform() * static_cast<double>(all.size()))];
    for (const std::string& line : bridge_.receive(from, bytes, milliseconds(1))) {
      (void)read(line);
      ++passed;
    }
    (void)message_text(from.type, bytes);
    (void)bridge_.take_reports();
  }
  EXPECT_GT(passed, 0);
  EXPECT_GT(bridge_.dropped(), 1000U);
}

TEST_F(Bridge, ComparesCalibrationAndMountingWithTheRobotFile) {
  (void)odometry(0);
  const RobotDescription robot = limo();
  ros2::CameraInfo info = ros2::to_ros(robot.camera, at_ms(1));
  info.header.frame_id = "camera_color_optical_frame";
  EXPECT_TRUE(give("/camera/color/camera_info", info, milliseconds(1)).empty());
  const auto mounted = [](const SE3& base_T_cam) {
    return ros2::TFMessage{
        {ros2::to_ros_transform(at_ms(0), "base_link", "camera_link", SE3()),
         ros2::to_ros_transform(at_ms(0), "camera_link", "camera_color_optical_frame", base_T_cam)}};
  };
  (void)give("/tf_static", mounted(robot.model.base_T_cam), milliseconds(1));
  EXPECT_EQ(words(), "") << "both are equal";
  info.k[0] += 100;
  (void)give("/camera/color/camera_info", info, milliseconds(2));
  EXPECT_NE(words().find("camera_info"), std::string::npos);
  (void)give("/camera/color/camera_info", info, milliseconds(3));
  EXPECT_EQ(words(), "") << "reported once";
}

TEST_F(Bridge, ReportsADifferentMounting) {
  (void)odometry(0);
  ros2::CameraInfo info = ros2::to_ros(limo().camera, at_ms(1));
  info.header.frame_id = "eye";
  (void)give("/camera/color/camera_info", info, milliseconds(1));
  SE3 moved = limo().model.base_T_cam;
  moved = SE3(moved.rotation(), moved.translation() + Eigen::Vector3d(0.05, 0, 0));
  (void)give("/tf_static", ros2::TFMessage{{ros2::to_ros_transform(at_ms(0), "base_link", "eye", moved)}},
             milliseconds(2));
  const std::string reports = words();
  EXPECT_NE(reports.find("50 mm"), std::string::npos);
  testing::expect_on_page("robots", reports);
}

TEST_F(Bridge, IgnoresANonFiniteMounting) {
  (void)odometry(0);
  ros2::CameraInfo info = ros2::to_ros(limo().camera, at_ms(1));
  info.header.frame_id = "eye";
  (void)give("/camera/color/camera_info", info, milliseconds(1));
  auto link = ros2::to_ros_transform(at_ms(0), "base_link", "eye", limo().model.base_T_cam);
  link.rotation.y = std::numeric_limits<double>::quiet_NaN();
  (void)give("/tf_static", ros2::TFMessage{{link}}, milliseconds(2));
  const std::string reports = words();
  EXPECT_EQ(reports.find(" mm and "), std::string::npos) << reports;
  testing::expect_on_page("robots", reports);
}

TEST_F(Bridge, RotatesImuDataIntoTheBaseFrame) {
  (void)odometry(0);
  // The IMU is mounted on its side, with its x axis along the z axis of the base.
  const SE3 base_T_imu(SO3::from_rpy(0, -1.5707963267948966, 0), Eigen::Vector3d::Zero());
  (void)give("/tf_static",
             ros2::TFMessage{{ros2::to_ros_transform(at_ms(0), "base_link", "imu_link", base_T_imu)}},
             milliseconds(1));
  ros2::Imu imu = ros2::to_ros(ImuSample{.stamp = at_ms(2), .angular_velocity_rad_s = {0.5, 0, 0}});
  imu.header.frame_id = "imu_link";
  const auto lines = give("/imu", imu, milliseconds(2));
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NEAR(std::get<ImuSample>(read(lines[0])).angular_velocity_rad_s.z(), 0.5, 1e-9);
}

TEST_F(Bridge, EncodesCommandsAsTheTypeOfTheProfile) {
  const auto plain = cdr::decode<ros2::Twist>(bridge_.command({0.3, -0.2}, at_ms(0)));
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->linear.x, 0.3);
  EXPECT_EQ(plain->angular.z, -0.2);
  const RobotBridge stamped(find_ros2_profile("turtlebot3").value(), limo());
  const auto message = cdr::decode<ros2::TwistStamped>(stamped.command({0.1, 0}, at_ms(7)));
  ASSERT_TRUE(message);
  EXPECT_EQ(ros2::from_ros(message->header.stamp), at_ms(7));
}

SensorTime stamp_ms(int ms) { return SensorTime(std::chrono::seconds(1000) + std::chrono::milliseconds(ms)); }

RobotDescription limo_file() { return read_robot(find_shared("robots", "limo").value()).value(); }

template <class Message>
void send(RobotBridge& bridge, const std::string& topic, const Message& message) {
  (void)bridge.receive({topic, std::string(Message::kType), {}}, cdr::encode(message),
                       std::chrono::milliseconds(20));
}

TEST(BridgeFrames, TakeTheBaseFromOdometryUnlessTheProfileNamesIt) {
  Ros2Profile profile = find_ros2_profile("limo").value();
  profile.base_frame.clear();
  RobotBridge bridge(profile, limo_file());
  ros2::Odometry odometry = ros2::to_ros(Odometry{.stamp = stamp_ms(0)});
  odometry.child_frame_id = "r1/base_footprint";
  send(bridge, "/odom", odometry);
  ros2::Image image = ros2::to_ros(CameraFrame{.stamp = stamp_ms(10), .image = Image(64, 48)});
  image.header.frame_id = "r1/eye";
  send(bridge, "/camera/color/image_raw", image);
  const ros2::TFMessage tf{
      {ros2::to_ros_transform(stamp_ms(0), "r1/base_footprint", "r1/eye", SE3({}, {5, 0, 0}))}};
  send(bridge, "/tf_static", tf);
  EXPECT_NE(test::reports_of(bridge).find(" mm and "), std::string::npos);
}

TEST(BridgeFrames, RejectACycleOfTransforms) {
  RobotBridge bridge(find_ros2_profile("limo").value(), limo_file());
  send(bridge, "/odom", ros2::to_ros(Odometry{.stamp = stamp_ms(0)}));
  ros2::Image image = ros2::to_ros(CameraFrame{.stamp = stamp_ms(10), .image = Image(64, 48)});
  image.header.frame_id = "camera_color_optical_frame";
  send(bridge, "/camera/color/image_raw", image);
  ros2::TFMessage circle{{ros2::to_ros_transform(stamp_ms(0), "base_link", "mast", SE3({}, {0, 0, 0.5})),
                          ros2::to_ros_transform(stamp_ms(0), "mast", "camera_color_optical_frame", SE3())}};
  circle.transforms.push_back(
      ros2::to_ros_transform(stamp_ms(0), "camera_color_optical_frame", "base_link", SE3({}, {1, 2, 3})));
  send(bridge, "/tf_static", circle);
  const std::string reports = test::reports_of(bridge);
  EXPECT_EQ(reports.find(" mm and "), std::string::npos) << reports;
  testing::expect_on_page("robots", reports);
}

}  // namespace
}  // namespace waymark
