#include "waymark/drivers/gstreamer/libgst.hpp"

#ifdef WAYMARK_HAVE_GSTREAMER

#include <string>

#include <dlfcn.h>

namespace waymark::internal {
namespace {

constexpr const char* kPackages = "gstreamer1.0-plugins-base gstreamer1.0-plugins-good";

tl::unexpected<Error> missing(const std::string& what) {
  return fail(ErrorCode::Unsupported, "gstreamer: needs GStreamer: " + what, {},
              std::string("Install it: sudo apt install ") + kPackages);
}

template <class Function>
void look_up(void* library, const char* name, Function& function, std::string& absent) {
  function = library == nullptr ? nullptr : reinterpret_cast<Function>(::dlsym(library, name));
  if (function == nullptr) absent = std::string("there is no ") + name;
}

Result<Gstreamer> load() {
  const auto open = [](const char* name) { return ::dlopen(name, RTLD_NOW | RTLD_LOCAL); };
  void* core = open("libgstreamer-1.0.so.0");
  void* app = open("libgstapp-1.0.so.0");
  void* gobject = open("libgobject-2.0.so.0");
  void* glib = open("libglib-2.0.so.0");
  Gstreamer gst;
  std::string absent;
#define WAYMARK_GSTREAMER_CORE(name) look_up(core, #name, gst.name, absent);
#define WAYMARK_GSTREAMER_SINK(name) look_up(app, #name, gst.name, absent);
#define WAYMARK_GSTREAMER_OBJECT(name) look_up(gobject, #name, gst.name, absent);
#define WAYMARK_GSTREAMER_GLIB(name) look_up(glib, #name, gst.name, absent);
  WAYMARK_GSTREAMER(WAYMARK_GSTREAMER_CORE)
  WAYMARK_GSTREAMER_APP(WAYMARK_GSTREAMER_SINK)
  WAYMARK_GOBJECT(WAYMARK_GSTREAMER_OBJECT)
  WAYMARK_GLIB(WAYMARK_GSTREAMER_GLIB)
#undef WAYMARK_GSTREAMER_CORE
#undef WAYMARK_GSTREAMER_SINK
#undef WAYMARK_GSTREAMER_OBJECT
#undef WAYMARK_GSTREAMER_GLIB
  if (!absent.empty()) return missing(absent);
  GError* error = nullptr;
  if (gst.gst_init_check(nullptr, nullptr, &error) == 0) {
    const std::string words = error != nullptr ? error->message : "it does not start";
    if (error != nullptr) gst.g_error_free(error);
    return missing(words);
  }
  return gst;
}

}  // namespace

Result<const Gstreamer*> gstreamer() {
  static const Result<Gstreamer> loaded = load();
  if (!loaded) return tl::unexpected(loaded.error());
  return &*loaded;
}

}  // namespace waymark::internal

#endif
