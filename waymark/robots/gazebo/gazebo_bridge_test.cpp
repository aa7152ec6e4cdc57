#include "waymark/robots/gazebo/gazebo_bridge.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/robot_lines.hpp"
#include "waymark/config/share.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;

using ::testing::Test;

SensorTime at_ms(int ms) { return SensorTime(milliseconds(1000 + ms)); }

/// A bridge with a reader for its lines.
class GazeboBridgeTest : public Test {
 protected:
  std::vector<std::string> give(GazeboKind kind, Result<GazeboValue> value) {
    for (const GazeboSubscription& one : subscriptions_of(profile_))
      if (one.kind == kind) return bridge_.receive(one, {0, one.type, std::move(value), {}});
    return {};
  }
  std::vector<std::string> odometry(int ms, double x_m = 0) {
    return give(GazeboKind::Odometry, Odometry{.stamp = at_ms(ms), .odom_T_base = SE2(x_m, 0, 0)});
  }
  Sample read(const std::string& line) { return lines_.read(line); }
  std::string words() { return test::reports_of(bridge_); }

  GazeboProfile profile_ = find_gazebo_profile("limo").value();
  RobotDescription robot_ = read_robot(find_shared("robots", "limo-gazebo").value()).value();
  GazeboBridge bridge_{profile_, robot_};
  test::RobotLines lines_;
};

TEST_F(GazeboBridgeTest, SamplesRoundTrip) {
  EXPECT_TRUE(give(GazeboKind::Imu, ImuSample{.stamp = at_ms(0)}).empty()) << "before the odometry";
  const auto lines = odometry(0, 1.5);
  ASSERT_EQ(lines.size(), 1U);
  const auto odometry = std::get<Odometry>(read(lines[0]));
  EXPECT_EQ(odometry.stamp, at_ms(0));
  EXPECT_DOUBLE_EQ(odometry.odom_T_base.x(), 1.5);
  CameraFrame frame{.stamp = at_ms(10), .image = Image(64, 48)};
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) frame.image.row(y)[x] = static_cast<std::uint8_t>(3 * x + 5 * y);
  const auto raw = give(GazeboKind::Image, frame);
  ASSERT_EQ(raw.size(), 1U);
  const auto back = std::get<CameraFrame>(read(raw[0]));
  EXPECT_EQ(back.stamp, frame.stamp);
  for (int y = 0; y < 48; ++y)
    EXPECT_TRUE(std::equal(back.image.row(y), back.image.row(y) + 64, frame.image.row(y)));
  LaserScan scan{.stamp = at_ms(12), .angle_increment_rad = 0.1, .range_min_m = 0.1, .range_max_m = 8};
  scan.ranges_m = {1, 2, std::numeric_limits<float>::infinity()};
  EXPECT_EQ(give(GazeboKind::Scan, scan).size(), 1U);
  EXPECT_EQ(give(GazeboKind::Gamepad, GamepadState{.stamp = at_ms(13), .axes = {0.5F}}).size(), 1U);
  EXPECT_EQ(bridge_.dropped(), 0U) << words();
}

TEST_F(GazeboBridgeTest, TruthIsThePoseOfTheProfilesModel) {
  (void)odometry(0);
  const GazeboPoses poses{at_ms(1), {{"wall", SE3()}, {"limo", SE3(SO3(), {2, 0, 0})}}};
  const auto lines = give(GazeboKind::Truth, poses);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_DOUBLE_EQ(std::get<TruthPose>(read(lines[0])).map_T_base.translation().x(), 2);
  EXPECT_TRUE(give(GazeboKind::Truth, GazeboPoses{at_ms(2), {{"wall", SE3()}}}).empty());
  EXPECT_EQ(bridge_.dropped(), 0U);
}

TEST_F(GazeboBridgeTest, DropsAndCountsMisleadingMessages) {
  ASSERT_EQ(odometry(0).size(), 1U);
  EXPECT_TRUE(odometry(20, std::numeric_limits<double>::quiet_NaN()).empty());
  EXPECT_EQ(odometry(30).size(), 1U);
  EXPECT_TRUE(odometry(10).empty()) << "the simulation was reset";
  EXPECT_TRUE(give(GazeboKind::Imu, ImuSample{.stamp = at_ms(5000)}).empty()) << "a different clock";
  EXPECT_TRUE(give(GazeboKind::Imu, ImuSample{}).empty()) << "without a timestamp";
  EXPECT_TRUE(give(GazeboKind::Imu, Odometry{.stamp = at_ms(31)}).empty()) << "a different type";
  EXPECT_TRUE(give(GazeboKind::Image, fail(ErrorCode::Unreadable, "3 invalid bytes")).empty());
  EXPECT_EQ(bridge_.dropped(), 6U);
  const std::string reports = words();
  for (const char* part : {"0.020 s", "ignition.msgs.IMU", "3 invalid bytes"})
    EXPECT_NE(reports.find(part), std::string::npos) << part << " in " << reports;
  testing::expect_on_page("robots", reports);
}

TEST_F(GazeboBridgeTest, AcceptsAnySimulationSpeed) {
  // A hundred seconds of simulated time, as fast as possible.
  for (int ms = 0; ms < 100'000; ms += 20) {
    ASSERT_EQ(odometry(ms).size(), 1U) << ms;
    ASSERT_EQ(give(GazeboKind::Imu, ImuSample{.stamp = at_ms(ms)}).size(), 1U) << ms;
  }
}

TEST_F(GazeboBridgeTest, ComparesTheCalibrationWithTheRobotFile) {
  (void)give(GazeboKind::CameraInfo, GazeboCamera{{}, robot_.camera});
  EXPECT_EQ(words(), "");
  auto other = std::get<PinholeRadtan>(robot_.camera.projection());
  other.fx += 50;
  const auto camera = CameraModel::make(other, 640, 480);
  (void)give(GazeboKind::CameraInfo, GazeboCamera{{}, *camera});
  EXPECT_NE(words().find("640 x 480"), std::string::npos);
  (void)give(GazeboKind::CameraInfo, GazeboCamera{{}, *camera});
  EXPECT_EQ(words(), "") << "reported once";
}

}  // namespace
}  // namespace waymark
