#include "waymark/media/libav.hpp"

#ifdef WAYMARK_HAVE_LIBAV

#include <array>

#include <fmt/format.h>

#include "waymark/modules/load_module.hpp"

namespace waymark::internal {
namespace {

std::string file_of(const char* stem, int major) { return fmt::format("{}.so.{}", stem, major); }

tl::unexpected<Error> missing(const std::string& what) {
  return fail(ErrorCode::Unsupported, "video files require libavformat and libavcodec: " + what, {},
              fmt::format("Install them: sudo apt install libavformat{} libavcodec{}",
                          LIBAVFORMAT_VERSION_MAJOR, LIBAVCODEC_VERSION_MAJOR));
}

Result<Libav> load() {
  SharedLibrary util(file_of("libavutil", LIBAVUTIL_VERSION_MAJOR));
  SharedLibrary codec(file_of("libavcodec", LIBAVCODEC_VERSION_MAJOR));
  SharedLibrary format(file_of("libavformat", LIBAVFORMAT_VERSION_MAJOR));
  Libav av;
#define WAYMARK_LIBAV_UTIL(name) util.look_up(#name, av.name);
#define WAYMARK_LIBAV_CODEC(name) codec.look_up(#name, av.name);
#define WAYMARK_LIBAV_FORMAT(name) format.look_up(#name, av.name);
  WAYMARK_LIBAVUTIL(WAYMARK_LIBAV_UTIL)
  WAYMARK_LIBAVCODEC(WAYMARK_LIBAV_CODEC)
  WAYMARK_LIBAVCODEC_NEW(WAYMARK_LIBAV_CODEC)
  WAYMARK_LIBAVFORMAT(WAYMARK_LIBAV_FORMAT)
  WAYMARK_LIBAVFORMAT_OLD(WAYMARK_LIBAV_FORMAT)
#undef WAYMARK_LIBAV_UTIL
#undef WAYMARK_LIBAV_CODEC
#undef WAYMARK_LIBAV_FORMAT
  for (const SharedLibrary* library : {&util, &codec, &format})
    if (!library->missing().empty()) return missing(library->missing());
  av.av_log_set_level(AV_LOG_QUIET);
  return av;
}

}  // namespace

Result<const Libav*> libav() {
  static const Result<Libav> loaded = load();
  if (!loaded) return tl::unexpected(loaded.error());
  return &*loaded;
}

std::string text_of(const Libav& av, int error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> words{};
  av.av_strerror(error, words.data(), words.size());
  return words.data();
}

}  // namespace waymark::internal

#endif
