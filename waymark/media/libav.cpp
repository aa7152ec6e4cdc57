#include "waymark/media/libav.hpp"

#ifdef WAYMARK_HAVE_LIBAV

#include <dlfcn.h>

#include <array>

#include <fmt/format.h>

namespace waymark::internal {
namespace {

/// A library that is never unloaded.
struct Library {
  std::string name;
  void* handle;

  explicit Library(const char* stem, int major)
      : name(fmt::format("{}.so.{}", stem, major)), handle(::dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL)) {}
};

tl::unexpected<Error> missing(const std::string& what) {
  return fail(ErrorCode::Unsupported, "video files need libavformat and libavcodec: " + what, {},
              fmt::format("Install them: sudo apt install libavformat{} libavcodec{}",
                          LIBAVFORMAT_VERSION_MAJOR, LIBAVCODEC_VERSION_MAJOR));
}

template <class Function>
void look_up(const Library& library, const char* name, Function& function, std::string& absent) {
  function = reinterpret_cast<Function>(::dlsym(library.handle, name));
  if (function == nullptr) absent = fmt::format("{} has no {}", library.name, name);
}

Result<Libav> load() {
  const Library util("libavutil", LIBAVUTIL_VERSION_MAJOR);
  const Library codec("libavcodec", LIBAVCODEC_VERSION_MAJOR);
  const Library format("libavformat", LIBAVFORMAT_VERSION_MAJOR);
  for (const Library* library : {&util, &codec, &format})
    if (library->handle == nullptr) return missing(library->name + " cannot be loaded");
  Libav av;
  std::string absent;
#define WAYMARK_LIBAV_UTIL(name) look_up(util, #name, av.name, absent);
#define WAYMARK_LIBAV_CODEC(name) look_up(codec, #name, av.name, absent);
#define WAYMARK_LIBAV_FORMAT(name) look_up(format, #name, av.name, absent);
  WAYMARK_LIBAVUTIL(WAYMARK_LIBAV_UTIL)
  WAYMARK_LIBAVCODEC(WAYMARK_LIBAV_CODEC)
  WAYMARK_LIBAVCODEC_NEW(WAYMARK_LIBAV_CODEC)
  WAYMARK_LIBAVFORMAT(WAYMARK_LIBAV_FORMAT)
  WAYMARK_LIBAVFORMAT_OLD(WAYMARK_LIBAV_FORMAT)
#undef WAYMARK_LIBAV_UTIL
#undef WAYMARK_LIBAV_CODEC
#undef WAYMARK_LIBAV_FORMAT
  if (!absent.empty()) return missing(absent);
  av.av_log_set_level(AV_LOG_QUIET);
  return av;
}

}  // namespace

Result<const Libav*> libav() {
  static const Result<Libav> loaded = load();
  if (!loaded) return tl::unexpected(loaded.error());
  return &*loaded;
}

std::string words_of(const Libav& av, int error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> words{};
  av.av_strerror(error, words.data(), words.size());
  return words.data();
}

}  // namespace waymark::internal

#endif
