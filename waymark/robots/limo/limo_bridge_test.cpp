// Tests the samples that are computed from LIMO's frames.
#include "waymark/robots/limo/limo_bridge.hpp"

#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using std::chrono::milliseconds;

/// A LIMO that drives in a circle, and the bridge that receives its frames.
class Circle {
 public:
  explicit Circle(LimoDrive drive = LimoDrive::Differential) : drive_(drive) {}

  void drive(double seconds, double speed_m_s, double yaw_rate_rad_s, bool imu = true) {
    const double curvature = speed_m_s != 0 ? yaw_rate_rad_s / speed_m_s : 0;
    for (int k = 0; k < 50 * seconds; ++k) {
      now_ += milliseconds(20);
      yaw_rad_ += 0.02 * yaw_rate_rad_s;
      if (imu) {
        give(encode_angular_velocity({0, 0, yaw_rate_rad_s}));
        give(encode_attitude({std::remainder(2.5 + yaw_rad_, 2 * std::numbers::pi), 0, 0}));
      }
      give(encode_motion_feedback({.speed_m_s = speed_m_s,
                                   .yaw_rate_rad_s = drive_ == LimoDrive::Ackermann ? 0 : yaw_rate_rad_s,
                                   .steering_rad = steering_of_curvature(curvature)}));
    }
  }
  void give(const LimoFrame& frame) {
    for (const Sample& sample : bridge.receive(frame, drive_, now_, false))
      if (const auto* const odometry = std::get_if<Odometry>(&sample)) newest = *odometry;
  }

  LimoBridge bridge{0.045};
  Odometry newest{};
  double yaw_rad_ = 0;

 private:
  LimoDrive drive_;
  Duration now_ = std::chrono::seconds(50);
};

TEST(LimoOdometry, CountsSlowTurnsBelowTheThresholdOfLimosDriver) {
  // 0.08 rad/s is 0.092 degrees per message at 50 Hz, which is below the 0.1 degrees of LIMO's own driver.
  Circle robot;
  robot.drive(1, 0, 0);
  robot.drive(2 * std::numbers::pi / 0.08, 0.25, 0.08);
  EXPECT_NEAR(robot.newest.odom_T_base.yaw(), std::remainder(robot.yaw_rad_, 2 * std::numbers::pi), 0.002);
  EXPECT_LT(robot.newest.odom_T_base.translation().norm(), 0.03) << "a 19.6 m circle ends where it started";
  EXPECT_NEAR(robot.newest.yaw_rate_rad_s, 0.08, 2e-4);
}

TEST(LimoOdometry, HeadingIsContinuousWhenTheImuFailsAndReturns) {
  Circle robot;
  robot.drive(2, 0.2, 0.5);
  robot.drive(2, 0.2, 0.5, false);
  EXPECT_NEAR(robot.newest.odom_T_base.yaw(), robot.yaw_rad_, 0.03);
  const double before_rad = robot.newest.odom_T_base.yaw();
  robot.drive(0.1, 0.2, 0.5);
  EXPECT_NEAR(robot.newest.odom_T_base.yaw() - before_rad, 0.05, 0.02);
}

TEST(LimoOdometry, AckermannTurnsByItsSteering) {
  Circle robot(LimoDrive::Ackermann);
  robot.drive(4, 0.3, -0.5, false);
  EXPECT_NEAR(robot.newest.odom_T_base.yaw(), -2.0, 0.03);
  EXPECT_NEAR(robot.newest.yaw_rate_rad_s, -0.5, 0.01);
}

TEST(LimoOdometry, SkipsASingleImplausibleMessageAndAcceptsTwo) {
  Circle robot;
  robot.drive(2, 0.3, 0);
  const Odometry before = robot.newest;
  robot.give(encode_attitude({0, 0, 0}));
  robot.give(encode_motion_feedback({.speed_m_s = -2.5}));
  EXPECT_EQ(robot.newest.odom_T_base, before.odom_T_base);
  EXPECT_EQ(robot.bridge.rejected(), 1U);
  robot.drive(1, 0.3, 0);
  EXPECT_NEAR(robot.newest.odom_T_base.x(), before.odom_T_base.x() + 0.3, 0.01);
  EXPECT_NEAR(robot.newest.odom_T_base.yaw(), before.odom_T_base.yaw(), 1e-9);
  robot.drive(1, -0.9, 0);
  EXPECT_EQ(robot.newest.speed_m_s, -0.9);
}

TEST(FrameClock, EstimatesPeriodicStampsFromDelayedArrivals) {
  std::mt19937 random(3);
  std::exponential_distribution<double> delay_s(1 / 0.004);
  FrameClock clock;
  const double period_s = 1 / 50.7;
  double squares = 0;
  int counted = 0;
  SensorTime before{};
  Duration arrived_before{};
  for (int k = 0; k < 50 * 600; ++k) {
    const double sent_s = 100 + k * period_s;
    // USB bridges deliver the bytes from 16 ms together.
    const double handed_s = std::ceil((sent_s + delay_s(random)) / 0.016) * 0.016;
    const Duration arrived = std::max(arrived_before, Duration(static_cast<std::int64_t>(handed_s * 1e9)));
    arrived_before = arrived;
    const SensorTime stamp = clock.stamp(arrived);
    ASSERT_GT(stamp, before);
    before = stamp;
    if (k < 500) continue;
    ASSERT_LE(stamp.time_since_epoch(), arrived + Duration(64));
    const double late_s = to_seconds(stamp.time_since_epoch()) - sent_s;
    squares += late_s * late_s;
    ++counted;
  }
  EXPECT_NEAR(*clock.period_s(), period_s, 1e-4);
  EXPECT_LT(std::sqrt(squares / counted), 0.005) << "the arrival times vary by 13 ms";
}

TEST(FrameClock, LostMessagesDoNotShiftTheStamps) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> chance(0, 1);
  for (const bool reported : {true, false}) {
    FrameClock clock;
    double worst_s = 0;
    bool lost = false;
    for (int k = 0; k < 20000; ++k) {
      const double sent_s = 5 + 0.02 * k;
      if (k > 100 && chance(random) < 0.005) {
        lost = reported;
        continue;
      }
      const SensorTime stamp =
          clock.stamp(Duration(static_cast<std::int64_t>(1e9 * (sent_s + 0.002 * chance(random)))), lost);
      lost = false;
      worst_s = std::max(worst_s, std::abs(to_seconds(stamp.time_since_epoch()) - sent_s));
    }
    EXPECT_LT(worst_s, reported ? 0.003 : 0.065) << "unreported losses are corrected once the window is full";
  }
}

TEST(FrameClock, IgnoresTheRateOfABacklog) {
  FrameClock clock;
  SensorTime before{};
  for (int k = 0; k < 2000; ++k) {
    const Duration arrived = milliseconds(1000 + 20 * std::max(0, k - 40));
    const SensorTime stamp = clock.stamp(arrived, k % 7 == 0);
    ASSERT_GT(stamp, before) << k;
    ASSERT_LE(stamp.time_since_epoch(), arrived + Duration(64)) << k;
    before = stamp;
  }
  EXPECT_GT(*clock.period_s(), 0.01) << "a zero period would make timestamps non-finite";
}

TEST(FrameClock, RestartsAfterASilence) {
  FrameClock clock;
  for (int k = 0; k < 200; ++k) (void)clock.stamp(milliseconds(20 * k));
  for (int k = 0; k < 200; ++k) {
    const Duration arrived = milliseconds(60000 + 10 * k);
    EXPECT_LE(arrived - clock.stamp(arrived).time_since_epoch(), milliseconds(10)) << k;
  }
}

}  // namespace
}  // namespace waymark
