#include "waymark/drivers/gamepad/pad_input.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

using E = OperatorEvent;

constexpr std::size_t kB = 1, kY = 3, kBack = 4, kLeftShoulder = 9;

/// A pad that is not there.
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

class Pad : public testing::Test {
 protected:
  static SensorTime at(int milliseconds) { return SensorTime(std::chrono::milliseconds(milliseconds)); }
  GamepadState state_{.axes = std::vector<float>(6, 0.0F), .buttons = std::vector<std::int32_t>(15, 0)};
};

TEST_F(Pad, DrivesALapWhileTheShoulderIsHeldAndEndsItWithY) {
  PadLapDriver driver(std::make_unique<FakePad>(state_), 0.4);
  state_.axes[1] = 1;
  auto decision = driver.drive({}, at(50));
  ASSERT_TRUE(decision);
  EXPECT_EQ(decision->command, VelocityCommand{}) << "nobody holds the shoulder";
  ASSERT_TRUE(decision->pad);
  EXPECT_EQ(decision->pad->stamp, at(50));
  state_.buttons[kLeftShoulder] = 1;
  EXPECT_NEAR(driver.drive({}, at(100))->command.speed_m_s, 0.4, 1e-6);
  state_.buttons[kY] = 1;
  decision = driver.drive({}, at(150));
  EXPECT_TRUE(decision->done);
  EXPECT_EQ(decision->command, VelocityCommand{});
}

TEST_F(Pad, IsTheOperatorsButtonsAndSticks) {
  PadInput input(std::make_unique<FakePad>(state_), 0.4);
  const auto read = [&](int ms) { return input.read({}, at(ms), OperatorState::Teaching).value(); };
  EXPECT_TRUE(read(0).events.empty());
  for (const auto& [button, event] : {std::pair{kY, E::Go}, {kB, E::Stop}, {kBack, E::Quit}}) {
    state_.buttons[button] = 1;
    EXPECT_EQ(read(50).events, std::vector<E>{event});
    EXPECT_TRUE(read(100).events.empty()) << "held, not pressed again";
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

TEST_F(Pad, ThatIsUnpluggedIsAnError) {
  PadLapDriver driver(std::make_unique<FakePad>(state_), 0.4);
  PadInput input(std::make_unique<FakePad>(state_), 0.4);
  state_.buttons.clear();
  EXPECT_FALSE(driver.drive({}, at(50)));
  EXPECT_FALSE(input.read({}, at(50), OperatorState::Idle));
}

}  // namespace
}  // namespace waymark
