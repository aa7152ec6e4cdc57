#include "waymark/robots/mbot/mbot_bridge.hpp"

#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;

using ::testing::HasSubstr;

using ::testing::IsEmpty;

constexpr std::int64_t kSwitchedOn_us = 1'713'214'583'000'000;

/// Sends MBot messages to the bridge and collects its samples.
class Wire {
 public:
  explicit Wire(std::int64_t utime_us = kSwitchedOn_us) : utime_us_(utime_us) {
    (void)other_side_.read({.number = 1, .text = to_line(RobotHello{.name = "mbot"})});
  }

  template <class Message>
  void send(const std::string& channel, Message message) {
    if (message.utime == 0) message.utime = utime_us_ + now_ms_ * 1000;
    send_bytes(channel, mbot::encode(message));
  }
  void send_bytes(const std::string& channel, Bytes payload) {
    for (const std::string& line : bridge.receive({.channel = channel,
                                   .payload = std::move(payload),
                                   .arrived = milliseconds(now_ms_ + 5),
                                   .received_us = kHere_us + now_ms_ * 1000})) {
      const auto message = other_side_.read({.number = ++number_, .text = line});
      ASSERT_TRUE(message && *message) << line;
      samples.push_back(std::get<Sample>(**message));
    }
    for (const std::string& line : bridge.take_reports()) reports += line;
  }
  void wait(std::int64_t ms) { now_ms_ += ms; }
  /// The messages that a first-generation (Jetson) publisher sends in 40 ms.
  void send_period() {
    wait(40);
    send("MBOT_ODOMETRY", mbot::Pose2D{.x = 1, .y = 2, .theta = 0.5F});
    send("MBOT_VEL", mbot::Twist2D{.vx = 0.3F, .wz = -0.1F});
    send("MBOT_IMU", mbot::Imu{.gyro = {0, 0, 0.1F}, .accel = {0, 0, -9.7F}});
    send("MBOT_APRILTAG_ARRAY", mbot::TagArray{.tags = {tag()}});
  }
  /// In millimetres and degrees, quaternion order x y z w; 1.6 m ahead, turned by 150 degrees about x and
  /// slightly about the other axes.
  static mbot::Tag tag() {
    const Eigen::Quaterniond q = SO3::from_rpy(150 * kDegree, 10 * kDegree, -20 * kDegree).quaternion();
    const auto f = [](double x) { return static_cast<float>(x); };
    return {.id = 7,
            .position = {-257, 48, 1635},
            .angles_rpy = {150, 10, -20},
            .angles_quat = {f(q.x()), f(q.y()), f(q.z()), f(q.w())}};
  }
  template <class Kind>
  [[nodiscard]] std::vector<Kind> of() const {
    std::vector<Kind> list;
    for (const Sample& sample : samples)
      if (const auto* one = std::get_if<Kind>(&sample)) list.push_back(*one);
    return list;
  }

  MbotBridge bridge{};
  std::vector<Sample> samples{};
  std::string reports{};

 private:
  static constexpr double kDegree = 0.017453292519943295;
  static constexpr std::int64_t kHere_us = 1'790'000'000'000'000;  // time on a different clock
  RobotMessageReader other_side_{"test"};
  std::int64_t utime_us_;
  std::int64_t now_ms_ = 0;
  std::int64_t number_ = 1;
};

TEST(MbotBridge, ConvertsMessagesToLines) {
  Wire wire;
  for (int i = 0; i < 20; ++i) wire.send_period();
  const auto odometry = wire.of<Odometry>();
  ASSERT_EQ(odometry.size(), 20U) << "no message is lost while the conventions are being determined";
  EXPECT_EQ(odometry[0].stamp, SensorTime(std::chrono::microseconds(kSwitchedOn_us + 40'000)));
  EXPECT_NEAR(odometry[0].speed_m_s, 0.3, 1e-6) << "joined with the speed that has the same utime";
  EXPECT_EQ(wire.of<ImuSample>().size(), 20U);
  EXPECT_NEAR(wire.of<ImuSample>()[0].linear_acceleration_m_s2.z(), 9.7, 1e-5) << "specific force points up";
  const auto tags = wire.of<TagPoseFrame>();
  ASSERT_EQ(tags.size(), 20U);
  EXPECT_EQ(tags[0].stamp, odometry[0].stamp - milliseconds(65)) << "stamped when it was published";
  ASSERT_EQ(tags[0].tags.size(), 1U);
  EXPECT_EQ(to_string(tags[0].tags[0].tag), "tagCustom48h12:7");
  EXPECT_NEAR(tags[0].tags[0].cam_T_tag.translation().z(), 1.635, 1e-6);
  EXPECT_THAT(wire.reports, HasSubstr("millimetres"));
  EXPECT_EQ(wire.bridge.dropped(), 0U);
}

TEST(MbotBridge, AMessageWithoutStampGetsTheRobotsTimeOfItsArrival) {
  Wire wire;
  for (int i = 0; i < 20; ++i) wire.send_period();
  wire.wait(20);
  Bytes unstamped = mbot::encode(mbot::TagArray{.tags = {Wire::tag()}});  // with utime 0
  wire.send_bytes("MBOT_APRILTAG_ARRAY", std::move(unstamped));
  const TagPoseFrame newest = wire.of<TagPoseFrame>().back();
  const SensorTime now(std::chrono::microseconds(kSwitchedOn_us + 820'000));
  EXPECT_LT(std::abs(to_seconds(newest.stamp + milliseconds(65) - now)), 0.001)
      << "the robot's clock, not this computer's";
}

TEST(MbotBridge, DetectsTheQuaternionOrderOfTheSecondGeneration) {
  Wire wire;
  for (int i = 0; i < 20; ++i) {
    wire.wait(40);
    wire.send("MBOT_ODOMETRY", mbot::Pose2D{});
    wire.send("MBOT_IMU", mbot::Imu{.accel = {0, 0, 9.7F}});
    mbot::Tag tag = Wire::tag();
    tag.angles_quat = {tag.angles_quat[3], tag.angles_quat[0], tag.angles_quat[1], tag.angles_quat[2]};
    wire.send("MBOT_APRILTAG_ARRAY", mbot::TagArray{.tags = {tag}});
  }
  Wire first;
  for (int i = 0; i < 20; ++i) first.send_period();
  const auto seen = wire.of<TagPoseFrame>();
  ASSERT_FALSE(seen.empty());
  EXPECT_LT(
      (seen[0].tags[0].cam_T_tag.inverse() * first.of<TagPoseFrame>()[0].tags[0].cam_T_tag).log().norm(),
      1e-6);
  EXPECT_NEAR(wire.of<ImuSample>()[0].linear_acceleration_m_s2.z(), 9.7, 1e-5);
  EXPECT_THAT(wire.reports, HasSubstr("w, x, y, z"));
}

TEST(MbotBridge, WithoutTagsMessagesPassAfterASecond) {
  Wire wire;
  for (int i = 0; i < 30; ++i) {
    wire.wait(40);
    wire.send("MBOT_ODOMETRY", mbot::Pose2D{});
    wire.send("MBOT_IMU", mbot::Imu{.accel = {0, 0, 9.7F}});
    EXPECT_EQ(wire.bridge.speaks(), i > 25) << i;
  }
  EXPECT_GE(wire.of<Odometry>().size(), 29U) << "the newest message waits for its speed";
}

TEST(MbotBridge, CountsAndReportsUnknownFingerprints) {
  Wire wire;
  for (int i = 0; i < 3; ++i) wire.send_bytes("MBOT_ODOMETRY", Bytes(28, 0x11));
  wire.send_bytes("MBOT_IMU", Bytes{1, 2, 3});
  EXPECT_EQ(wire.bridge.dropped(), 4U);
  EXPECT_THAT(wire.reports, HasSubstr("3 messages of MBOT_ODOMETRY"));
  EXPECT_THAT(wire.reports, HasSubstr("1111111111111111"));
  testing::expect_on_page("robots", wire.reports);
  EXPECT_FALSE(wire.bridge.speaks());
}

TEST(MbotBridge, ReportsADifferentClockOnce) {
  Wire wire;
  wire.send("MBOT_TIMESYNC", mbot::Timestamp{});
  EXPECT_THAT(wire.reports, HasSubstr("(MBOT_TIMESYNC)"));
  testing::expect_on_page("robots", wire.reports);
  wire.reports.clear();
  wire.wait(1000);
  wire.send("MBOT_TIMESYNC", mbot::Timestamp{});
  EXPECT_THAT(wire.reports, IsEmpty());
}

TEST(MbotBridge, StampsOfAnotherClockAreDropped) {
  Wire wire;
  for (int i = 0; i < 20; ++i) wire.send_period();
  const std::size_t before = wire.of<ImuSample>().size();
  wire.wait(40);
  wire.send("MBOT_IMU", mbot::Imu{.utime = kSwitchedOn_us + 60'000'000, .accel = {0, 0, -9.7F}});
  EXPECT_EQ(wire.of<ImuSample>().size(), before);
  EXPECT_THAT(wire.reports, HasSubstr("the IMU"));
}

/// Every line must be readable, and all other messages must be counted as dropped.
TEST(MbotBridge, HostilePayloadsAreDroppedAndCounted) {
  Random random(11);
  Wire wire;
  for (int i = 0; i < 20; ++i) wire.send_period();
  const Bytes pose = mbot::encode(mbot::Pose2D{.utime = kSwitchedOn_us + 900'000});
  const Bytes imu = mbot::encode(mbot::Imu{.utime = kSwitchedOn_us + 900'000});
  const Bytes tags = mbot::encode(mbot::TagArray{.utime = kSwitchedOn_us + 900'000, .tags = {Wire::tag()}});
  mbot::Lidar turn{.utime = kSwitchedOn_us + 900'000, .ranges = {1, 2, 3}, .thetas = {0, 1, 2}};
  turn.times = {0, 0, 0};
  turn.intensities = {0, 0, 0};
  const Bytes lidar = mbot::encode(turn);
  for (int i = 0; i < 4000; ++i) {
    Bytes bytes = i % 4 == 0 ? pose : i % 4 == 1 ? imu : i % 4 == 2 ? tags : lidar;
    const auto flips = 1 + static_cast<int>(3 * random.uniform());
    for (int k = 0; k < flips; ++k)
      bytes[static_cast<std::size_t>(random.uniform() * static_cast<double>(bytes.size()))] =
          static_cast<std::uint8_t>(256 * random.uniform());
    if (random.uniform() < 0.2)
      bytes.resize(static_cast<std::size_t>(random.uniform() * static_cast<double>(bytes.size())));
    wire.send_bytes(i % 4 == 0   ? "MBOT_ODOMETRY"
                    : i % 4 == 1 ? "MBOT_IMU"
                    : i % 4 == 2 ? "TAGS"
                                 : "LIDAR",
                    std::move(bytes));
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
  }
  EXPECT_GT(wire.bridge.dropped(), 500U);
}

}  // namespace
}  // namespace waymark
