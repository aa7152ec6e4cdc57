#include "waymark/robots/limo/command_gate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr VelocityCommand kDrive{0.3, 0.1};

constexpr VelocityCommand kZero{};

/// The gate and a LIMO that reports its state every 20 ms.
class Gate {
 public:
  explicit Gate(LimoDrive file = LimoDrive::Differential) : gate(file) {}

  VelocityCommand step(const VelocityCommand& asked) {
    now += milliseconds(20);
    gate.receive(state, now);
    if (speaks) gate.receive(LimoMotion{.speed_m_s = speed_m_s}, now);
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

TEST(CommandGate, SendsZeroUntilLimoAcceptsCommands) {
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
  EXPECT_THAT(robot.gate.take_reports(), IsEmpty());
}

TEST(CommandGate, AfterRemoteControlTheDriverMustCommandZeroFirst) {
  Gate robot;
  EXPECT_EQ(robot.steps(5, kDrive), kDrive);
  robot.state.commanded = false;
  robot.speed_m_s = 0.4;
  EXPECT_EQ(robot.steps(2, kDrive), kZero);
  EXPECT_THAT(robot.gate.take_reports(), ElementsAre(HasSubstr("remote control")));
  EXPECT_EQ(robot.steps(100, kZero), kZero);
  EXPECT_FALSE(robot.gate.asks_for_command(robot.now)) << "someone drives it by remote control";
  robot.speed_m_s = 0;
  (void)robot.steps(2, kDrive);
  EXPECT_FALSE(robot.gate.asks_for_command(robot.now)) << "it would start to drive";
  (void)robot.steps(2, kZero);
  EXPECT_TRUE(robot.gate.asks_for_command(robot.now));
  (void)robot.steps(2, kDrive);
  robot.state.commanded = true;
  EXPECT_EQ(robot.steps(10, kDrive), kZero) << "there has been no zero since it accepts commands again";
  (void)robot.step(kZero);
  EXPECT_EQ(robot.step(kDrive), kDrive);
}

TEST(CommandGate, SendsZeroAfterAQuarterOfASecondWithoutMotion) {
  Gate robot;
  EXPECT_EQ(robot.steps(5, kDrive), kDrive);
  robot.speaks = false;
  EXPECT_EQ(robot.steps(12, kDrive), kDrive);
  EXPECT_EQ(robot.steps(1, kDrive), kZero);
  EXPECT_THAT(robot.gate.take_reports(), ElementsAre(HasSubstr("0.25 s")));
  robot.speaks = true;
  EXPECT_EQ(robot.step(kDrive), kDrive);
}

TEST(CommandGate, SendsZeroInEmergencyStopOnErrorsAndForAnotherDrive) {
  for (int what = 0; what < 4; ++what) {
    Gate robot;
    EXPECT_EQ(robot.steps(5, kDrive), kDrive);
    if (what == 0) robot.state.vehicle = LimoState::Vehicle::EmergencyStop;
    if (what == 1) robot.state.vehicle = LimoState::Vehicle::Exception;
    if (what == 2) robot.state.errors = 1U << 4U;
    if (what == 3) robot.state.drive = LimoDrive::Ackermann;
    EXPECT_EQ(robot.steps(2, kDrive), kZero) << what;
    const auto reports = robot.gate.take_reports();
    EXPECT_FALSE(reports.empty()) << what;
    for (const std::string& report : reports) testing::expect_on_page("robots", report);
    robot.state = {.commanded = true};
    EXPECT_EQ(robot.steps(5, kDrive), kZero) << what;
    (void)robot.step(kZero);
    EXPECT_EQ(robot.step(kDrive), kDrive) << what;
  }
  Gate low_battery;
  low_battery.state.errors = 3;
  EXPECT_EQ(low_battery.steps(5, kDrive), kDrive) << "a low battery is merely reported";
  EXPECT_THAT(low_battery.gate.take_reports(), ElementsAre(HasSubstr("battery"), HasSubstr("battery")));
}

TEST(CommandGate, IgnoresASingleDamagedFrame) {
  Gate robot;
  EXPECT_EQ(robot.steps(5, kDrive), kDrive);
  robot.state.commanded = false;
  EXPECT_EQ(robot.step(kDrive), kDrive);
  robot.state.commanded = true;
  EXPECT_EQ(robot.steps(3, kDrive), kDrive);
  EXPECT_THAT(robot.gate.take_reports(), IsEmpty());
}

TEST(CommandGate, AcceptsMecanumAndTracksForADifferentialRobotFile) {
  Gate robot;
  robot.state.drive = LimoDrive::Mecanum;
  EXPECT_EQ(robot.steps(5, kDrive), kDrive);
  EXPECT_EQ(robot.gate.drive(), LimoDrive::Mecanum);
  Gate tracks(LimoDrive::Tracked);
  EXPECT_EQ(tracks.steps(5, kDrive), kDrive);
}

}  // namespace
}  // namespace waymark
