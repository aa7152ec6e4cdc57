#include "waymark/drivers/gamepad/libsdl.hpp"

#ifdef WAYMARK_HAVE_SDL2

#include <dlfcn.h>

namespace waymark::internal {
namespace {

Result<Libsdl> load() {
  void* library = ::dlopen("libSDL2-2.0.so.0", RTLD_NOW | RTLD_LOCAL);
  Libsdl sdl;
  bool complete = library != nullptr;
#define WAYMARK_SDL_LOOK_UP(name)                                                                          \
  sdl.name = library == nullptr ? nullptr : reinterpret_cast<decltype(sdl.name)>(::dlsym(library, #name)); \
  complete = complete && sdl.name != nullptr;
  WAYMARK_SDL(WAYMARK_SDL_LOOK_UP)
#undef WAYMARK_SDL_LOOK_UP
  if (complete) return sdl;
  return fail(ErrorCode::Unsupported, "gamepads need SDL 2, which cannot be loaded", {},
              "Install it: sudo apt install libsdl2-2.0-0; or use --driver keyboard.");
}

}  // namespace

Result<const Libsdl*> libsdl() {
  static const Result<Libsdl> loaded = load();
  if (!loaded) return tl::unexpected(loaded.error());
  return &*loaded;
}

}  // namespace waymark::internal

#endif
