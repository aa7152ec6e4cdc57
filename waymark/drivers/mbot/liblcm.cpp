#include "waymark/drivers/mbot/liblcm.hpp"

#ifdef WAYMARK_HAVE_LCM

#include <string>

#include <dlfcn.h>

namespace waymark::internal {
namespace {

Result<Liblcm> load() {
  void* library = ::dlopen("liblcm.so.1", RTLD_NOW | RTLD_LOCAL);
  Liblcm lcm;
  bool complete = library != nullptr;
#define WAYMARK_LCM_LOOK_UP(name)                                                                          \
  lcm.name = library == nullptr ? nullptr : reinterpret_cast<decltype(lcm.name)>(::dlsym(library, #name)); \
  complete = complete && lcm.name != nullptr;
  WAYMARK_LCM(WAYMARK_LCM_LOOK_UP)
#undef WAYMARK_LCM_LOOK_UP
  if (complete) return lcm;
  return fail(ErrorCode::Unsupported, "robots on LCM need liblcm, which cannot be loaded", {.source = "LCM"},
              "Install it: sudo apt install liblcm1");
}

}  // namespace

Result<const Liblcm*> liblcm() {
  static const Result<Liblcm> loaded = load();
  if (!loaded) return tl::unexpected(loaded.error());
  return &*loaded;
}

}  // namespace waymark::internal

#endif
