#include "waymark/inputs/gamepad/libsdl.hpp"

#ifdef WAYMARK_HAVE_SDL2

#include "waymark/modules/load_module.hpp"

namespace waymark::internal {
namespace {

Result<Libsdl> load() {
  SharedLibrary library("libSDL2-2.0.so.0");
  Libsdl sdl;
#define WAYMARK_SDL_LOOK_UP(name) library.look_up(#name, sdl.name);
  WAYMARK_SDL(WAYMARK_SDL_LOOK_UP)
#undef WAYMARK_SDL_LOOK_UP
  if (library.missing().empty()) return sdl;
  return fail(ErrorCode::Unsupported, "gamepads need SDL 2: " + library.missing(), {},
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
