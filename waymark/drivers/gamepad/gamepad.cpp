#include "waymark/drivers/gamepad/gamepad.hpp"

#ifdef WAYMARK_HAVE_SDL2

#include <SDL2/SDL.h>

namespace waymark {
namespace {

constexpr float kFullStick = 32767.0F;

class SdlGamepad final : public Gamepad {
 public:
  explicit SdlGamepad(SDL_GameController* pad) : pad_(pad) {}
  SdlGamepad(const SdlGamepad&) = delete;
  SdlGamepad& operator=(const SdlGamepad&) = delete;
  ~SdlGamepad() override {
    SDL_GameControllerClose(pad_);
    SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
  }

  Result<GamepadState> poll(SensorTime now) override {
    SDL_GameControllerUpdate();
    if (SDL_GameControllerGetAttached(pad_) == SDL_FALSE)
      return fail(ErrorCode::Unreadable, "the gamepad was unplugged");
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

 private:
  SDL_GameController* pad_;
};

}  // namespace

Result<std::unique_ptr<Gamepad>> open_gamepad() {
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");
  if (SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER) != 0)
    return fail(ErrorCode::Unreadable, std::string("gamepads cannot be used: ") + SDL_GetError());
  for (int i = 0; i < SDL_NumJoysticks(); ++i) {
    if (SDL_IsGameController(i) == SDL_FALSE) continue;
    if (SDL_GameController* pad = SDL_GameControllerOpen(i)) return std::make_unique<SdlGamepad>(pad);
  }
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
