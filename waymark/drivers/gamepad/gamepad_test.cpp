// A gamepad that SDL takes for a real one: a virtual device of its own.
#include "waymark/drivers/gamepad/gamepad.hpp"

#include <gtest/gtest.h>

#ifdef WAYMARK_HAVE_SDL2
#include <SDL2/SDL.h>

#include "waymark/drivers/gamepad/stick_driver.hpp"

namespace waymark {
namespace {

SensorTime at(int ms) { return SensorTime(std::chrono::milliseconds(ms)); }

/// Plugged in as long as it lives.
class VirtualPad {
 public:
  VirtualPad() {
    SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
    SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");
    if (SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER) != 0) return;
    index_ = SDL_JoystickAttachVirtual(SDL_JOYSTICK_TYPE_GAMECONTROLLER, SDL_CONTROLLER_AXIS_MAX,
                                       SDL_CONTROLLER_BUTTON_MAX, 0);
    if (index_ >= 0) pad_ = SDL_JoystickOpen(index_);
  }
  VirtualPad(const VirtualPad&) = delete;
  VirtualPad& operator=(const VirtualPad&) = delete;
  ~VirtualPad() {
    unplug();
    SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
  }
  void unplug() {
    if (pad_ != nullptr) SDL_JoystickClose(pad_);
    pad_ = nullptr;
    if (index_ >= 0) SDL_JoystickDetachVirtual(index_);
    index_ = -1;
  }
  [[nodiscard]] bool plugged_in() const { return pad_ != nullptr; }
  void push(SDL_GameControllerAxis axis, int value) {
    SDL_JoystickSetVirtualAxis(pad_, axis, static_cast<Sint16>(value));
  }
  void press(SDL_GameControllerButton button, bool down = true) {
    SDL_JoystickSetVirtualButton(pad_, button, down ? 1 : 0);
  }

 private:
  int index_ = -1;
  SDL_Joystick* pad_ = nullptr;
};

TEST(Gamepad, ADeviceOfSdlDrivesTheRobot) {
  VirtualPad device;
  if (!device.plugged_in()) GTEST_SKIP() << "no virtual gamepads here: " << SDL_GetError();
  const auto pad = open_gamepad();
  ASSERT_TRUE(pad) << to_string(pad.error());
  StickDriver driver({.speed_m_s = 0.5});
  const auto asked = [&](int ms) {
    const auto state = (*pad)->poll(at(ms));
    EXPECT_TRUE(state) << to_string(state.error());
    EXPECT_EQ(state->stamp, at(ms));
    EXPECT_EQ(state->axes.size(), 6U);
    driver.add(*state);
    return driver.drive(at(ms));
  };

  device.push(SDL_CONTROLLER_AXIS_LEFTY, -32768);   // away from oneself
  device.push(SDL_CONTROLLER_AXIS_RIGHTX, -32768);  // to the left
  EXPECT_EQ(asked(0), VelocityCommand{}) << "the left shoulder is not held";
  device.press(SDL_CONTROLLER_BUTTON_LEFTSHOULDER);
  auto command = asked(50);
  ASSERT_TRUE(command);
  EXPECT_NEAR(command->speed_m_s, 0.5, 1e-3);
  EXPECT_GT(command->yaw_rate_rad_s, 0.1);
  device.push(SDL_CONTROLLER_AXIS_LEFTY, 0);
  device.push(SDL_CONTROLLER_AXIS_RIGHTX, 0);
  EXPECT_EQ(asked(100), VelocityCommand{});
  device.press(SDL_CONTROLLER_BUTTON_Y);
  EXPECT_FALSE(asked(150)) << "Y ends the lap";

  device.unplug();
  const auto gone = (*pad)->poll(at(200));
  ASSERT_FALSE(gone);
  EXPECT_NE(gone.error().message.find("unplugged"), std::string::npos);
}

}  // namespace
}  // namespace waymark
#endif
