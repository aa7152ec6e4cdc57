#include "waymark/drivers/gamepad/gamepad.hpp"

#ifdef WAYMARK_HAVE_SDL2

#include <algorithm>
#include <chrono>

#include <SDL2/SDL.h>

namespace waymark {
namespace {

constexpr float kFullStick = 32767.0F;

SDL_GameController* open_first() {
  for (int i = 0; i < SDL_NumJoysticks(); ++i) {
    if (SDL_IsGameController(i) == SDL_FALSE) continue;
    if (SDL_GameController* pad = SDL_GameControllerOpen(i)) return pad;
  }
  return nullptr;
}

class SdlGamepad final : public Gamepad {
 public:
  explicit SdlGamepad(SDL_GameController* pad) : pad_(pad) {}
  SdlGamepad(const SdlGamepad&) = delete;
  SdlGamepad& operator=(const SdlGamepad&) = delete;
  ~SdlGamepad() override {
    if (pad_ != nullptr) SDL_GameControllerClose(pad_);
    SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
  }

  Result<GamepadState> poll(SensorTime now) override {
    SDL_GameControllerUpdate();
    if (!attached()) return fail(ErrorCode::Unreadable, "the gamepad was unplugged");
    GamepadState state{.stamp = now};
    const auto axis = [&](SDL_GameControllerAxis index, float sign) {
      state.axes.push_back(sign * static_cast<float>(SDL_GameControllerGetAxis(pad_, index)) / kFullStick);
    };
    axis(SDL_CONTROLLER_AXIS_LEFTX, -1);
    axis(SDL_CONTROLLER_AXIS_LEFTY, -1);
    axis(SDL_CONTROLLER_AXIS_RIGHTX, -1);
    axis(SDL_CONTROLLER_AXIS_RIGHTY, -1);
    axis(SDL_CONTROLLER_AXIS_TRIGGERLEFT, 1);
    axis(SDL_CONTROLLER_AXIS_TRIGGERRIGHT, 1);
    for (int button = SDL_CONTROLLER_BUTTON_A; button <= SDL_CONTROLLER_BUTTON_DPAD_RIGHT; ++button)
      state.buttons.push_back(
          SDL_GameControllerGetButton(pad_, static_cast<SDL_GameControllerButton>(button)));
    return state;
  }

  void show(const PadSignal& signal) override {
    if (pad_ == nullptr) return;
    const auto strength = static_cast<Uint16>(65535 * std::clamp(signal.rumble, 0.0, 1.0));
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(signal.rumble_for).count();
    (void)SDL_GameControllerSetLED(pad_, signal.light_rgb[0], signal.light_rgb[1], signal.light_rgb[2]);
    (void)SDL_GameControllerRumble(pad_, strength, strength, static_cast<Uint32>(ms));
  }

 private:
  /// One that is gone is looked for again.
  bool attached() {
    if (pad_ != nullptr && SDL_GameControllerGetAttached(pad_) == SDL_TRUE) return true;
    if (pad_ != nullptr) SDL_GameControllerClose(pad_);
    pad_ = open_first();
    return pad_ != nullptr;
  }

  SDL_GameController* pad_;  ///< nullptr: unplugged
};

}  // namespace

Result<std::unique_ptr<Gamepad>> open_gamepad() {
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");
  if (SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER) != 0)
    return fail(ErrorCode::Unreadable, std::string("gamepads cannot be used: ") + SDL_GetError());
  if (SDL_GameController* pad = open_first()) return std::make_unique<SdlGamepad>(pad);
  SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
  return fail(ErrorCode::NotFound, "no gamepad is plugged in", {}, "Plug one in, or use --driver keyboard.");
}

}  // namespace waymark

#else

namespace waymark {

Result<std::unique_ptr<Gamepad>> open_gamepad() {
  return fail(ErrorCode::Unsupported, "this waymark was built without gamepads", {},
              "Install libsdl2-dev and build again, or use --driver keyboard.");
}

}  // namespace waymark

#endif
