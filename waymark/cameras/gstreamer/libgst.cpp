#include "waymark/cameras/gstreamer/libgst.hpp"

#ifdef WAYMARK_HAVE_GSTREAMER

#include <string>

#include "waymark/modules/load_module.hpp"

namespace waymark::internal {
namespace {

constexpr const char* kPackages = "gstreamer1.0-plugins-base gstreamer1.0-plugins-good";

tl::unexpected<Error> missing(const std::string& what) {
  return fail(ErrorCode::Unsupported, "gstreamer: needs GStreamer: " + what, {},
              std::string("Install it: sudo apt install ") + kPackages);
}

Result<Gstreamer> load() {
  SharedLibrary core("libgstreamer-1.0.so.0");
  SharedLibrary app("libgstapp-1.0.so.0");
  SharedLibrary gobject("libgobject-2.0.so.0");
  SharedLibrary glib("libglib-2.0.so.0");
  Gstreamer gst;
#define WAYMARK_GSTREAMER_CORE(name) core.look_up(#name, gst.name);
#define WAYMARK_GSTREAMER_SINK(name) app.look_up(#name, gst.name);
#define WAYMARK_GSTREAMER_OBJECT(name) gobject.look_up(#name, gst.name);
#define WAYMARK_GSTREAMER_GLIB(name) glib.look_up(#name, gst.name);
  WAYMARK_GSTREAMER(WAYMARK_GSTREAMER_CORE)
  WAYMARK_GSTREAMER_APP(WAYMARK_GSTREAMER_SINK)
  WAYMARK_GOBJECT(WAYMARK_GSTREAMER_OBJECT)
  WAYMARK_GLIB(WAYMARK_GSTREAMER_GLIB)
#undef WAYMARK_GSTREAMER_CORE
#undef WAYMARK_GSTREAMER_SINK
#undef WAYMARK_GSTREAMER_OBJECT
#undef WAYMARK_GSTREAMER_GLIB
  for (const SharedLibrary* library : {&core, &app, &gobject, &glib})
    if (!library->missing().empty()) return missing(library->missing());
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
