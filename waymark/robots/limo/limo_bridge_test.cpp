// What LIMO's frames become, and which commands reach its wheels.
#include "waymark/robots/limo/limo_bridge.hpp"

#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/robots/limo/command_gate.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr VelocityCommand kDrive{0.3, 0.1};
constexpr VelocityCommand kZero{};

/// A LIMO that drives a circle, and what the bridge makes of its frames.
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

TEST(LimoOdometry, SlowTurnsAreCountedWhichTheDriverOfTheMakerDrops) {
  // 0.08 rad/s is 0.092 degrees from message to message at 50 Hz: all of it is below the maker's threshold.
  Circle robot;
  robot.drive(1, 0, 0);
  robot.drive(2 * std::numbers::pi / 0.08, 0.25, 0.08);
  EXPECT_NEAR(robot.newest.odom_T_base.yaw(), std::remainder(robot.yaw_rad_, 2 * std::numbers::pi), 0.002);
  EXPECT_LT(robot.newest.odom_T_base.translation().norm(), 0.03) << "a circle of 19.6 m ends where it began";
  EXPECT_NEAR(robot.newest.yaw_rate_rad_s, 0.08, 2e-4);
}

TEST(LimoOdometry, WithoutAnImuTheHeadingComesFromTheWheelsAndDoesNotLeapWhenItIsBack) {
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

TEST(LimoOdometry, OneMessageThatLeapsIsLeftOutTwoAreBelieved) {
  Circle robot;
  robot.drive(2, 0.3, 0);
  const Odometry before = robot.newest;
  robot.give(encode_attitude({0, 0, 0}));
  robot.give(encode_motion_feedback({.speed_m_s = -2.5}));
  EXPECT_EQ(robot.newest.odom_T_base, before.odom_T_base);
  EXPECT_EQ(robot.bridge.refused(), 1U);
  robot.drive(1, 0.3, 0);
  EXPECT_NEAR(robot.newest.odom_T_base.x(), before.odom_T_base.x() + 0.3, 0.01);
  EXPECT_NEAR(robot.newest.odom_T_base.yaw(), before.odom_T_base.yaw(), 1e-9);
  robot.drive(1, -0.9, 0);
  EXPECT_EQ(robot.newest.speed_m_s, -0.9);
}

/// The gate, and a LIMO that says every 20 ms how it is.
class Gate {
 public:
  explicit Gate(LimoDrive file = LimoDrive::Differential) : gate(file) {}

  VelocityCommand step(const VelocityCommand& asked) {
    now += milliseconds(20);
    gate.hear(state, now);
    if (speaks) gate.hear(LimoMotion{.speed_m_s = speed_m_s}, now);
    return gate.pass(asked, now);
  }
  VelocityCommand steps(int count, const VelocityCommand& asked) {
    VelocityCommand passed;
    for (int k = 0; k < count; ++k) passed = step(asked);
    return passed;
  }

  CommandGate gate;
  LimoState state{.commanded = true};
  double speed_m_s = 0;
  bool speaks = true;
  Duration now = std::chrono::seconds(9);
};

TEST(CommandGate, NothingMovesBeforeLimoObeys) {
  Gate robot;
  robot.state.commanded = false;
  EXPECT_TRUE(robot.gate.asks_for_command(robot.now));
  EXPECT_FALSE(robot.gate.asks_for_command(robot.now)) << "five times a second";
  EXPECT_EQ(robot.steps(20, kDrive), kZero);
  EXPECT_TRUE(robot.gate.asks_for_command(robot.now));
  EXPECT_FALSE(robot.gate.ready());
  robot.state.commanded = true;
  EXPECT_EQ(robot.steps(3, kDrive), kDrive);
  EXPECT_TRUE(robot.gate.ready());
  EXPECT_FALSE(robot.gate.asks_for_command(robot.now));
  EXPECT_THAT(robot.gate.take_words(), IsEmpty());
}

TEST(CommandGate, TheRemoteControlIsNotFoughtAndTheDriverMustAskForZeroBeforeItDrivesAgain) {
  Gate robot;
  EXPECT_EQ(robot.steps(5, kDrive), kDrive);
  robot.state.commanded = false;
  robot.speed_m_s = 0.4;
  EXPECT_EQ(robot.steps(2, kDrive), kZero);
  EXPECT_THAT(robot.gate.take_words(), ElementsAre(HasSubstr("remote control")));
  EXPECT_EQ(robot.steps(100, kZero), kZero);
  EXPECT_FALSE(robot.gate.asks_for_command(robot.now)) << "somebody drives it";
  robot.speed_m_s = 0;
  (void)robot.steps(2, kDrive);
  EXPECT_FALSE(robot.gate.asks_for_command(robot.now)) << "it would drive off";
  (void)robot.steps(2, kZero);
  EXPECT_TRUE(robot.gate.asks_for_command(robot.now));
  (void)robot.steps(2, kDrive);
  robot.state.commanded = true;
  EXPECT_EQ(robot.steps(10, kDrive), kZero) << "no zero since it obeys again";
  (void)robot.step(kZero);
  EXPECT_EQ(robot.step(kDrive), kDrive);
}

TEST(CommandGate, SilenceOfAQuarterOfASecondIsZeroWithWords) {
  Gate robot;
  EXPECT_EQ(robot.steps(5, kDrive), kDrive);
  robot.speaks = false;
  EXPECT_EQ(robot.steps(12, kDrive), kDrive);
  EXPECT_EQ(robot.steps(1, kDrive), kZero);
  EXPECT_THAT(robot.gate.take_words(), ElementsAre(HasSubstr("nothing was heard")));
  robot.speaks = true;
  EXPECT_EQ(robot.step(kDrive), kDrive);
}

TEST(CommandGate, EmergencyStopErrorsAndTheWrongLatchesAreZero) {
  for (int what = 0; what < 4; ++what) {
    Gate robot;
    EXPECT_EQ(robot.steps(5, kDrive), kDrive);
    if (what == 0) robot.state.vehicle = LimoState::Vehicle::EmergencyStop;
    if (what == 1) robot.state.vehicle = LimoState::Vehicle::Exception;
    if (what == 2) robot.state.errors = 1U << 4U;
    if (what == 3) robot.state.drive = LimoDrive::Ackermann;
    EXPECT_EQ(robot.steps(2, kDrive), kZero) << what;
    EXPECT_FALSE(robot.gate.take_words().empty()) << what;
    robot.state = {.commanded = true};
    EXPECT_EQ(robot.steps(5, kDrive), kZero) << what;
    (void)robot.step(kZero);
    EXPECT_EQ(robot.step(kDrive), kDrive) << what;
  }
  Gate tired;
  tired.state.errors = 3;
  EXPECT_EQ(tired.steps(5, kDrive), kDrive) << "a low battery is said, no more";
  EXPECT_THAT(tired.gate.take_words(), ElementsAre(HasSubstr("nearly empty"), HasSubstr("low")));
}

TEST(CommandGate, OneDamagedFrameDoesNotStopIt) {
  Gate robot;
  EXPECT_EQ(robot.steps(5, kDrive), kDrive);
  robot.state.commanded = false;
  EXPECT_EQ(robot.step(kDrive), kDrive);
  robot.state.commanded = true;
  EXPECT_EQ(robot.steps(3, kDrive), kDrive);
  EXPECT_THAT(robot.gate.take_words(), IsEmpty());
}

TEST(CommandGate, MecanumAndTracksAreDrivenByTheFileOfTheDifferentialDrive) {
  Gate robot;
  robot.state.drive = LimoDrive::Mecanum;
  EXPECT_EQ(robot.steps(5, kDrive), kDrive);
  EXPECT_EQ(robot.gate.drive(), LimoDrive::Mecanum);
  Gate tracks(LimoDrive::Tracked);
  EXPECT_EQ(tracks.steps(5, kDrive), kDrive);
}

}  // namespace
}  // namespace waymark
