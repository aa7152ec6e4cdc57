#include "waymark/inputs/gamepad/stick_driver.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "waymark/inputs/gamepad/gamepad.hpp"

namespace waymark {
namespace {

/// A pad that is not there: what it says is set by hand.
class FakeGamepad final : public Gamepad {
 public:
  Result<GamepadState> poll(SensorTime now) override {
    if (unplugged) return fail(ErrorCode::Unreadable, "the gamepad was unplugged");
    GamepadState said = state;
    said.stamp = now;
    return said;
  }
  GamepadState state{.axes = std::vector<float>(6, 0.0F), .buttons = std::vector<std::int32_t>(15, 0)};
  bool unplugged = false;
};

SensorTime at(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

TEST(StickDriver, NothingMovesUnlessTheDeadMansButtonIsHeld) {
  FakeGamepad pad;
  StickDriver driver({.speed_m_s = 0.5, .yaw_rate_rad_s = 1.0});
  EXPECT_EQ(driver.drive(at(0)), VelocityCommand{}) << "before the pad said anything";
  pad.state.axes[1] = 1;
  pad.state.axes[2] = -1;
  driver.add(pad.poll(at(1)).value());
  EXPECT_EQ(driver.drive(at(1)), VelocityCommand{});
  pad.state.buttons[9] = 1;
  driver.add(pad.poll(at(1.05)).value());
  EXPECT_EQ(driver.drive(at(1.05)), (VelocityCommand{0.5, -1.0}));
  pad.state.buttons[9] = 0;
  driver.add(pad.poll(at(1.1)).value());
  EXPECT_EQ(driver.drive(at(1.1)), VelocityCommand{});
}

TEST(StickDriver, ASilentPadStopsTheRobot) {
  FakeGamepad pad;
  StickDriver driver({});
  pad.state.axes[1] = 1;
  pad.state.buttons[9] = 1;
  driver.add(pad.poll(at(1)).value());
  EXPECT_NE(driver.drive(at(1.25)), VelocityCommand{});
  EXPECT_EQ(driver.drive(at(1.26)), VelocityCommand{});
  pad.unplugged = true;
  EXPECT_FALSE(pad.poll(at(2)));
}

TEST(StickDriver, TheDeadZoneIsQuietAndItsEdgeDoesNotJump) {
  FakeGamepad pad;
  StickDriver driver({.speed_m_s = 1, .dead_zone = 0.1});
  pad.state.buttons[9] = 1;
  const auto speed = [&](float stick) {
    pad.state.axes.at(1) = stick;
    driver.add(pad.poll(at(1)).value());
    return driver.drive(at(1))->speed_m_s;
  };
  EXPECT_EQ(speed(0.09F), 0);
  EXPECT_NEAR(speed(0.11F), 0.0111, 1e-3);
  EXPECT_NEAR(speed(-0.55F), -0.5, 1e-6);
  EXPECT_EQ(speed(std::numeric_limits<float>::quiet_NaN()), 0);
}

TEST(StickDriver, YEndsTheLap) {
  FakeGamepad pad;
  StickDriver driver({});
  pad.state.buttons[3] = 1;
  driver.add(pad.poll(at(1)).value());
  pad.state.buttons[3] = 0;
  driver.add(pad.poll(at(1.1)).value());
  EXPECT_FALSE(driver.drive(at(1.1)));
}

TEST(Gamepad, WithoutOneThatIsSaid) {
  const auto pad = open_gamepad();
  if (pad) GTEST_SKIP() << "a gamepad is plugged in";
  EXPECT_FALSE(pad.error().hint.empty());
}

}  // namespace
}  // namespace waymark
