#include "waymark/robots/limo/command_gate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr VelocityCommand kDrive{0.3, 0.1};

constexpr VelocityCommand kZero{};

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
