#include "waymark/robots/mbot/liblcm.hpp"

#ifdef WAYMARK_HAVE_LCM

#include "waymark/modules/load_module.hpp"

namespace waymark::internal {
namespace {

Result<Liblcm> load() {
  SharedLibrary library("liblcm.so.1");
  Liblcm lcm;
#define WAYMARK_LCM_LOOK_UP(name) library.look_up(#name, lcm.name);
  WAYMARK_LCM(WAYMARK_LCM_LOOK_UP)
#undef WAYMARK_LCM_LOOK_UP
  if (library.missing().empty()) return lcm;
  return fail(ErrorCode::Unsupported, "robots on LCM need liblcm: " + library.missing(), {.source = "LCM"},
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
