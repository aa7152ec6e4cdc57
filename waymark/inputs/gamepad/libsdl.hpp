#pragma once

#ifdef WAYMARK_HAVE_SDL2

#include <SDL2/SDL.h>

#include "waymark/base/error.hpp"

namespace waymark::internal {

// clang-format off
#define WAYMARK_SDL(F)                                                                         \
  F(SDL_SetHint) F(SDL_InitSubSystem) F(SDL_QuitSubSystem) F(SDL_GetError) F(SDL_NumJoysticks) \
  F(SDL_IsGameController) F(SDL_GameControllerOpen) F(SDL_GameControllerClose)                 \
  F(SDL_GameControllerGetAttached) F(SDL_GameControllerUpdate) F(SDL_GameControllerGetAxis)    \
  F(SDL_GameControllerGetButton) F(SDL_GameControllerSetLED) F(SDL_GameControllerRumble)
// clang-format on

/// The functions of SDL that are used here, looked up when first needed: linking SDL brings 36 shared
/// libraries of windows and sound, with which every start of the program takes 1.6 times the processor time
/// (medians of `waymark --version` with and without LD_PRELOAD=libSDL2-2.0.so.0 in one run).
struct Libsdl {
// NOLINTNEXTLINE(bugprone-macro-parentheses): a declaration
#define WAYMARK_SDL_MEMBER(name) decltype(&::name) name = nullptr;
  WAYMARK_SDL(WAYMARK_SDL_MEMBER)
#undef WAYMARK_SDL_MEMBER
};

/// The library, loaded by the first call and then kept. Unsupported where it is missing: the error names the
/// package. May be called from any thread.
[[nodiscard]] Result<const Libsdl*> libsdl();

}  // namespace waymark::internal

#endif
