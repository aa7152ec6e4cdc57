// Tests with a virtual SDL device, which is opened like a real gamepad.
#include "waymark/inputs/gamepad/gamepad.hpp"

#include <gtest/gtest.h>

#ifdef WAYMARK_HAVE_SDL2
#include <array>
#include <cstdint>
#include <vector>

#include <SDL2/SDL.h>

#include "waymark/inputs/gamepad/pad_input.hpp"
#endif

namespace waymark {
namespace {

TEST(Gamepad, OpeningFailsWithAHintIfNoneIsConnected) {
  const auto pad = open_gamepad();
  if (pad) GTEST_SKIP() << "a gamepad is plugged in";
  EXPECT_FALSE(pad.error().hint.empty());
}

}  // namespace
}  // namespace waymark

#ifdef WAYMARK_HAVE_SDL2

namespace waymark {
namespace {

SensorTime at(int ms) { return SensorTime(std::chrono::milliseconds(ms)); }

/// A virtual gamepad with a light and motors. It is connected until unplug() is called, and again after
/// plug_in().
class VirtualPad {
 public:
  VirtualPad() {
    SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
    SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");
    if (SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER) != 0) return;
    plug_in();
  }
  VirtualPad(const VirtualPad&) = delete;
  VirtualPad& operator=(const VirtualPad&) = delete;
  ~VirtualPad() {
    unplug();
    SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
  }
  void plug_in() {
    SDL_VirtualJoystickDesc device{};
    device.version = SDL_VIRTUAL_JOYSTICK_DESC_VERSION;
    device.type = SDL_JOYSTICK_TYPE_GAMECONTROLLER;
    device.naxes = SDL_CONTROLLER_AXIS_MAX;
    device.nbuttons = SDL_CONTROLLER_BUTTON_MAX;
    device.userdata = this;
    device.Rumble = [](void* self, Uint16 low, Uint16 /*high*/) {
      static_cast<VirtualPad*>(self)->rumbles_.push_back(low);
      return 0;
    };
    device.SetLED = [](void* self, Uint8 red, Uint8 green, Uint8 blue) {
      static_cast<VirtualPad*>(self)->lights_.push_back({red, green, blue});
      return 0;
    };
    index_ = SDL_JoystickAttachVirtualEx(&device);
    if (index_ >= 0) pad_ = SDL_JoystickOpen(index_);
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

  [[nodiscard]] const std::vector<std::array<std::uint8_t, 3>>& lights() const { return lights_; }
  [[nodiscard]] const std::vector<int>& rumbles() const { return rumbles_; }

 private:
  std::vector<std::array<std::uint8_t, 3>> lights_{};
  std::vector<int> rumbles_{};
  int index_ = -1;
  SDL_Joystick* pad_ = nullptr;
};

TEST(Gamepad, AnSdlDeviceDrivesTheRobot) {
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

  device.push(SDL_CONTROLLER_AXIS_LEFTY, -32768);   // forward
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
  EXPECT_EQ(gone.error().code, ErrorCode::Unreadable);
}

TEST(Gamepad, WorksAgainAfterReconnectionWithLightAndRumble) {
  VirtualPad device;
  if (!device.plugged_in()) GTEST_SKIP() << "no virtual gamepads here: " << SDL_GetError();
  const auto pad = open_gamepad();
  ASSERT_TRUE(pad) << to_string(pad.error());
  (*pad)->show({.light_rgb = {255, 0, 10}, .rumble = 0.5, .rumble_for = std::chrono::milliseconds(100)});
  ASSERT_FALSE(device.lights().empty());
  EXPECT_EQ(device.lights().back(), (std::array<std::uint8_t, 3>{255, 0, 10}));
  ASSERT_FALSE(device.rumbles().empty());
  EXPECT_NEAR(device.rumbles().back(), 32767, 1);

  device.unplug();
  EXPECT_FALSE((*pad)->poll(at(0)));
  (*pad)->show({.light_rgb = {1, 2, 3}});  // has no effect
  EXPECT_FALSE((*pad)->poll(at(50)));
  device.plug_in();
  ASSERT_TRUE(device.plugged_in());
  device.press(SDL_CONTROLLER_BUTTON_Y);
  const auto back = (*pad)->poll(at(100));
  ASSERT_TRUE(back) << to_string(back.error());
  (void)(*pad)->poll(at(150));
  EXPECT_EQ((*pad)->poll(at(200))->buttons.at(3), 1);
  (*pad)->show({.light_rgb = {4, 5, 6}});
  EXPECT_EQ(device.lights().back(), (std::array<std::uint8_t, 3>{4, 5, 6}));
}

}  // namespace
}  // namespace waymark
#endif
