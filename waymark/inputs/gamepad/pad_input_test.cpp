#include "waymark/inputs/gamepad/pad_input.hpp"

#include <chrono>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/inputs/gamepad/gamepad.hpp"

namespace waymark {
namespace {

/// A gamepad whose state is set by the test.
class FakeGamepad final : public Gamepad {
 public:
  Result<GamepadState> poll(SensorTime now) override {
    if (unplugged) return fail(ErrorCode::Unreadable, "the gamepad was unplugged");
    GamepadState stamped = state;
    stamped.stamp = now;
    return stamped;
  }
  GamepadState state{.axes = std::vector<float>(6, 0.0F), .buttons = std::vector<std::int32_t>(15, 0)};
  bool unplugged = false;
};

SensorTime at(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

TEST(StickDriver, NothingMovesUnlessTheDeadManButtonIsHeld) {
  FakeGamepad pad;
  StickDriver driver({.speed_m_s = 0.5, .yaw_rate_rad_s = 1.0});
  EXPECT_EQ(driver.drive(at(0)), VelocityCommand{}) << "before the first state";
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

TEST(StickDriver, ASilentGamepadStopsTheRobot) {
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

TEST(StickDriver, TheDeadZoneIsZeroAndContinuousAtItsEdge) {
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

using E = OperatorEvent;

constexpr std::size_t kB = 1, kY = 3, kBack = 4, kLeftShoulder = 9;

/// A gamepad whose state is set by the test; it counts as unplugged if it has no buttons.
class FakePad final : public Gamepad {
 public:
  explicit FakePad(const GamepadState& state) : state_(state) {}
  Result<GamepadState> poll(SensorTime now) override {
    if (state_.buttons.empty()) return fail(ErrorCode::Unreadable, "the gamepad was unplugged");
    GamepadState state = state_;
    state.stamp = now;
    return state;
  }

 private:
  const GamepadState& state_;
};

class Pad : public ::testing::Test {
 protected:
  static SensorTime at(int milliseconds) { return SensorTime(std::chrono::milliseconds(milliseconds)); }
  GamepadState state_{.axes = std::vector<float>(6, 0.0F), .buttons = std::vector<std::int32_t>(15, 0)};
};

TEST_F(Pad, DrivesWhileTheShoulderButtonIsHeldAndEndsTheLapWithY) {
  PadLapDriver driver(std::make_unique<FakePad>(state_), 0.4);
  state_.axes[1] = 1;
  auto decision = driver.drive({}, at(50));
  ASSERT_TRUE(decision);
  EXPECT_EQ(decision->command, VelocityCommand{}) << "the shoulder button is not held";
  ASSERT_TRUE(decision->pad);
  EXPECT_EQ(decision->pad->stamp, at(50));
  state_.buttons[kLeftShoulder] = 1;
  EXPECT_NEAR(driver.drive({}, at(100))->command.speed_m_s, 0.4, 1e-6);
  state_.buttons[kY] = 1;
  decision = driver.drive({}, at(150));
  EXPECT_TRUE(decision->done);
  EXPECT_EQ(decision->command, VelocityCommand{});
}

TEST_F(Pad, ConvertsButtonsToOperatorEventsAndSticksToCommands) {
  PadInput input(std::make_unique<FakePad>(state_), 0.4);
  const auto read = [&](int ms) { return input.read({}, at(ms), OperatorState::Teaching).value(); };
  EXPECT_TRUE(read(0).events.empty());
  for (const auto& [button, event] : {std::pair{kY, E::Go}, {kB, E::Stop}, {kBack, E::Quit}}) {
    state_.buttons[button] = 1;
    EXPECT_EQ(read(50).events, std::vector<E>{event});
    EXPECT_TRUE(read(100).events.empty()) << "still held";
    state_.buttons[button] = 0;
    (void)read(150);
  }
  state_.buttons[kLeftShoulder] = 1;
  state_.axes[1] = 1;
  const OperatorRequest request = read(200);
  EXPECT_NEAR(request.command.speed_m_s, 0.4, 1e-6);
  EXPECT_EQ(request.events, std::vector<E>{E::StickMoved});
  ASSERT_TRUE(request.pad);
}

TEST_F(Pad, UnpluggingStopsTheRobotUntilTheButtonIsReleasedOnce) {
  PadLapDriver driver(std::make_unique<FakePad>(state_), 0.4);
  state_.axes[1] = 1;
  state_.buttons[kLeftShoulder] = 1;
  EXPECT_NEAR(driver.drive({}, at(0))->command.speed_m_s, 0.4, 1e-6);
  const std::vector<std::int32_t> held = std::exchange(state_.buttons, {});
  auto gone = driver.drive({}, at(50));
  ASSERT_TRUE(gone);
  EXPECT_EQ(gone->command, VelocityCommand{});
  EXPECT_FALSE(gone->pad);
  EXPECT_FALSE(gone->done);
  ASSERT_EQ(gone->messages.size(), 1U);
  testing::expect_on_page("inputs", gone->messages[0]);
  EXPECT_TRUE(driver.drive({}, at(100))->messages.empty()) << "reported once";

  state_.buttons = held;  // plugged in with the shoulder button held
  const auto back = driver.drive({}, at(150));
  ASSERT_EQ(back->messages.size(), 1U);
  testing::expect_on_page("inputs", back->messages[0]);
  EXPECT_EQ(back->command, VelocityCommand{}) << "the shoulder button has not been released yet";
  state_.buttons[kLeftShoulder] = 0;
  (void)driver.drive({}, at(200));
  state_.buttons[kLeftShoulder] = 1;
  EXPECT_NEAR(driver.drive({}, at(250))->command.speed_m_s, 0.4, 1e-6);
}

TEST_F(Pad, UnpluggingPausesAReplay) {
  PadInput input(std::make_unique<FakePad>(state_), 0.4);
  const auto read = [&](int ms, OperatorState state) {
    return input.read(std::chrono::milliseconds(ms), at(ms), state).value();
  };
  EXPECT_TRUE(read(0, OperatorState::Replaying).events.empty());
  state_.buttons.clear();
  const OperatorRequest gone = read(50, OperatorState::Replaying);
  EXPECT_EQ(gone.events, std::vector<E>{E::Go}) << "pauses the replay";
  EXPECT_EQ(gone.messages.size(), 1U);
  EXPECT_TRUE(read(100, OperatorState::Replaying).events.empty()) << "a second press within 0.3 s is ignored";
  EXPECT_EQ(read(500, OperatorState::Replaying).events, std::vector<E>{E::Go}) << "the replay still drives";
  EXPECT_TRUE(read(1000, OperatorState::Paused).events.empty()) << "the replay does not resume by itself";
  EXPECT_TRUE(read(1500, OperatorState::Teaching).events.empty());
}

/// Records the signals that it is asked to show.
class ShownPad final : public Gamepad {
 public:
  explicit ShownPad(std::vector<PadSignal>& shown) : shown_(shown) {}
  Result<GamepadState> poll(SensorTime now) override { return GamepadState{.stamp = now}; }
  void show(const PadSignal& signal) override { shown_.push_back(signal); }

 private:
  std::vector<PadSignal>& shown_;
};

TEST(PadLight, ShowsEachStateOnceAndRumblesWhenAReplayEnds) {
  std::vector<PadSignal> shown;
  PadInput input(std::make_unique<ShownPad>(shown), 0.4);
  using S = OperatorState;
  for (const S state : {S::Replaying, S::Replaying, S::Stopped, S::Stopped})
    (void)input.read({}, SensorTime(), state);
  EXPECT_EQ(shown, (std::vector{signal_of(S::Replaying), signal_of(S::Stopped)}));
  EXPECT_EQ(signal_of(S::Replaying).rumble, 0);
  EXPECT_GT(signal_of(S::Stopped).rumble, 0);
  EXPECT_NE(signal_of(S::Teaching).light_rgb, signal_of(S::Replaying).light_rgb);
}

}  // namespace
}  // namespace waymark
