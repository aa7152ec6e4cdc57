#include "waymark/inputs/gamepad/gamepad.hpp"

#ifdef WAYMARK_HAVE_SDL2

#include <algorithm>
#include <chrono>

#include <SDL2/SDL.h>

#include "waymark/modules/load_module.hpp"

namespace waymark {
namespace {

// clang-format off
#define WAYMARK_SDL(F)                                                                         \
  F(SDL_SetHint) F(SDL_InitSubSystem) F(SDL_QuitSubSystem) F(SDL_GetError) F(SDL_NumJoysticks) \
  F(SDL_IsGameController) F(SDL_GameControllerOpen) F(SDL_GameControllerClose)                 \
  F(SDL_GameControllerGetAttached) F(SDL_GameControllerUpdate) F(SDL_GameControllerGetAxis)    \
  F(SDL_GameControllerGetButton) F(SDL_GameControllerSetLED) F(SDL_GameControllerRumble)
// clang-format on

/// The SDL functions used here, looked up on first use. Linking against SDL would load 36 shared libraries
/// for windows and sound, and every start would take 1.6 times the processor time. (These are medians of
/// starts that print the version, measured in one run with and without LD_PRELOAD=libSDL2-2.0.so.0.)
struct Libsdl {
// NOLINTNEXTLINE(bugprone-macro-parentheses): a declaration
#define WAYMARK_SDL_MEMBER(name) decltype(&::name) name = nullptr;
  WAYMARK_SDL(WAYMARK_SDL_MEMBER)
#undef WAYMARK_SDL_MEMBER
};

Result<Libsdl> load() {
  SharedLibrary library("libSDL2-2.0.so.0");
  Libsdl sdl;
#define WAYMARK_SDL_LOOK_UP(name) library.look_up(#name, sdl.name);
  WAYMARK_SDL(WAYMARK_SDL_LOOK_UP)
#undef WAYMARK_SDL_LOOK_UP
  if (library.missing().empty()) return sdl;
  return fail(ErrorCode::Unsupported, "gamepads require SDL 2: " + library.missing(), {},
              "Install it: sudo apt install libsdl2-2.0-0; or use `driver=keyboard`.");
}

/// The library, which the first call loads and which stays loaded. Fails (Unsupported) if it is missing; the
/// hint names the package. Thread-safe.
Result<const Libsdl*> libsdl() {
  static const Result<Libsdl> loaded = load();
  if (!loaded) return tl::unexpected(loaded.error());
  return &*loaded;
}

constexpr float kFullStick = 32767.0F;

SDL_GameController* open_first(const Libsdl& sdl) {
  for (int i = 0; i < sdl.SDL_NumJoysticks(); ++i) {
    if (sdl.SDL_IsGameController(i) == SDL_FALSE) continue;
    if (SDL_GameController* pad = sdl.SDL_GameControllerOpen(i)) return pad;
  }
  return nullptr;
}

class SdlGamepad final : public Gamepad {
 public:
  SdlGamepad(const Libsdl& sdl, SDL_GameController* pad) : sdl_(sdl), pad_(pad) {}
  SdlGamepad(const SdlGamepad&) = delete;
  SdlGamepad& operator=(const SdlGamepad&) = delete;
  ~SdlGamepad() override {
    if (pad_ != nullptr) sdl_.SDL_GameControllerClose(pad_);
    sdl_.SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
  }

  Result<GamepadState> poll(SensorTime now) override {
    sdl_.SDL_GameControllerUpdate();
    if (!attached()) return fail(ErrorCode::Unreadable, "the gamepad was unplugged");
    GamepadState state{.stamp = now};
    const auto axis = [&](SDL_GameControllerAxis index, float sign) {
      state.axes.push_back(sign * static_cast<float>(sdl_.SDL_GameControllerGetAxis(pad_, index)) /
                           kFullStick);
    };
    axis(SDL_CONTROLLER_AXIS_LEFTX, -1);
    axis(SDL_CONTROLLER_AXIS_LEFTY, -1);
    axis(SDL_CONTROLLER_AXIS_RIGHTX, -1);
    axis(SDL_CONTROLLER_AXIS_RIGHTY, -1);
    axis(SDL_CONTROLLER_AXIS_TRIGGERLEFT, 1);
    axis(SDL_CONTROLLER_AXIS_TRIGGERRIGHT, 1);
    for (int button = SDL_CONTROLLER_BUTTON_A; button <= SDL_CONTROLLER_BUTTON_DPAD_RIGHT; ++button)
      state.buttons.push_back(
          sdl_.SDL_GameControllerGetButton(pad_, static_cast<SDL_GameControllerButton>(button)));
    return state;
  }

  void show(const PadSignal& signal) override {
    if (pad_ == nullptr) return;
    const auto strength = static_cast<Uint16>(65535 * std::clamp(signal.rumble, 0.0, 1.0));
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(signal.rumble_for).count();
    (void)sdl_.SDL_GameControllerSetLED(pad_, signal.light_rgb[0], signal.light_rgb[1], signal.light_rgb[2]);
    (void)sdl_.SDL_GameControllerRumble(pad_, strength, strength, static_cast<Uint32>(ms));
  }

 private:
  /// Whether a gamepad is connected; searches again after it has been unplugged.
  bool attached() {
    if (pad_ != nullptr && sdl_.SDL_GameControllerGetAttached(pad_) == SDL_TRUE) return true;
    if (pad_ != nullptr) sdl_.SDL_GameControllerClose(pad_);
    pad_ = open_first(sdl_);
    return pad_ != nullptr;
  }

  const Libsdl& sdl_;
  SDL_GameController* pad_;  ///< nullptr while unplugged
};

}  // namespace

Result<std::unique_ptr<Gamepad>> open_gamepad() {
  const Result<const Libsdl*> loaded = libsdl();
  if (!loaded) return tl::unexpected(loaded.error());
  const Libsdl& sdl = **loaded;
  sdl.SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  sdl.SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");
  if (sdl.SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER) != 0)
    return fail(ErrorCode::Unreadable, std::string("cannot use gamepads: ") + sdl.SDL_GetError());
  if (SDL_GameController* pad = open_first(sdl)) return std::make_unique<SdlGamepad>(sdl, pad);
  sdl.SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
  return fail(ErrorCode::NotFound, "no gamepad is plugged in", {}, "Plug one in, or use `driver=keyboard`.");
}

}  // namespace waymark

#else

namespace waymark {

Result<std::unique_ptr<Gamepad>> open_gamepad() {
  return fail(ErrorCode::Unsupported, "this program was built without gamepads", {},
              "Install libsdl2-dev and rebuild, or use `driver=keyboard`.");
}

}  // namespace waymark

#endif
