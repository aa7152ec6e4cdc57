#pragma once

#ifdef WAYMARK_HAVE_LIBAV

#include <memory>
#include <string>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/error.h>
#include <libavutil/log.h>
#include <libavutil/opt.h>
#include <libavutil/pixdesc.h>
}

#include "waymark/base/error.hpp"

/// The functions of libavformat, libavcodec and libavutil used here, looked up on first use.
namespace waymark::internal {

// clang-format has no stable layout for these lists.
// clang-format off
#define WAYMARK_LIBAVUTIL(F)                                                                                \
  F(av_log_set_level)                                                                                       \
  F(av_strerror)                                                                                            \
  F(av_dict_set)                                                                                            \
  F(av_dict_free)                                                                                           \
  F(av_frame_alloc)                                                                                         \
  F(av_frame_free)                                                                                          \
  F(av_frame_unref) F(av_frame_get_buffer) F(av_frame_make_writable) F(av_pix_fmt_desc_get) F(av_rescale_q) \
      F(av_malloc) F(av_free) F(av_freep) F(av_display_rotation_get) F(av_display_rotation_set)             \
          F(av_opt_set)
#define WAYMARK_LIBAVCODEC(F)                                                                     \
  F(avcodec_find_encoder_by_name)                                                                 \
  F(avcodec_alloc_context3)                                                                       \
  F(avcodec_free_context)                                                                         \
  F(avcodec_parameters_to_context)                                                                \
  F(avcodec_parameters_from_context)                                                              \
  F(avcodec_open2)                                                                                \
  F(avcodec_send_packet) F(avcodec_receive_frame) F(avcodec_send_frame) F(avcodec_receive_packet) \
      F(avcodec_get_name) F(avcodec_descriptor_get) F(avcodec_find_decoder) F(av_packet_alloc)    \
          F(av_packet_free) F(av_packet_unref) F(av_packet_rescale_ts)
#define WAYMARK_LIBAVFORMAT(F)                                                                       \
  F(avformat_alloc_context)                                                                          \
  F(avformat_open_input)                                                                             \
  F(avformat_close_input)                                                                            \
  F(avformat_find_stream_info)                                                                       \
  F(avformat_free_context)                                                                           \
  F(av_find_best_stream)                                                                             \
  F(av_read_frame) F(avformat_alloc_output_context2) F(avformat_new_stream) F(avformat_write_header) \
      F(av_interleaved_write_frame) F(av_write_trailer) F(avio_alloc_context) F(avio_context_free)   \
          F(avio_open) F(avio_closep)
// clang-format on

#if LIBAVCODEC_VERSION_INT >= AV_VERSION_INT(60, 30, 100)
#define WAYMARK_LIBAVCODEC_NEW(F) F(av_packet_side_data_new)
#define WAYMARK_LIBAVFORMAT_OLD(F)
#else
#define WAYMARK_LIBAVCODEC_NEW(F)
#define WAYMARK_LIBAVFORMAT_OLD(F) F(av_stream_new_side_data)
#endif

struct Libav {
// NOLINTNEXTLINE(bugprone-macro-parentheses): a declaration
#define WAYMARK_LIBAV_MEMBER(name) decltype(&::name) name = nullptr;
  WAYMARK_LIBAVUTIL(WAYMARK_LIBAV_MEMBER)
  WAYMARK_LIBAVCODEC(WAYMARK_LIBAV_MEMBER)
  WAYMARK_LIBAVCODEC_NEW(WAYMARK_LIBAV_MEMBER)
  WAYMARK_LIBAVFORMAT(WAYMARK_LIBAV_MEMBER)
  WAYMARK_LIBAVFORMAT_OLD(WAYMARK_LIBAV_MEMBER)
#undef WAYMARK_LIBAV_MEMBER
};

/// The libraries, which the first call loads and which stay loaded; their own log messages are disabled.
/// Fails (Unsupported) if they are missing; the hint names the packages to install. Thread-safe.
[[nodiscard]] Result<const Libav*> libav();
/// The library's description of an error code.
[[nodiscard]] std::string text_of(const Libav& av, int error);

/// Frees memory allocated by the libraries.
struct LibavDeleter {
  const Libav* av = nullptr;
  void operator()(AVCodecContext* codec) const { av->avcodec_free_context(&codec); }
  void operator()(AVPacket* packet) const { av->av_packet_free(&packet); }
  void operator()(AVFrame* frame) const { av->av_frame_free(&frame); }
};
template <class T>
using LibavPtr = std::unique_ptr<T, LibavDeleter>;

}  // namespace waymark::internal

#endif
