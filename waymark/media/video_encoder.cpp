#include "waymark/media/video_encoder.hpp"

#ifdef WAYMARK_HAVE_LIBAV

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace waymark::internal {
namespace {

struct Encoder {
  const char* name;
  std::vector<std::pair<const char*, std::string>> settings;
};

/// Encoders of a codec, the preferred first; those that a build lacks are passed over.
std::vector<Encoder> encoders_of(VideoCodec codec, int quality) {
  const std::string crf = std::to_string(quality);
  const std::string crf63 = std::to_string(quality * 63 / 51);
  switch (codec) {
    case VideoCodec::H264:
      return {{"libx264", {{"preset", "veryfast"}, {"crf", crf}}}, {"libopenh264", {}}, {"mpeg4", {}}};
    case VideoCodec::Hevc:
      return {{"libx265", {{"preset", "ultrafast"}, {"crf", crf}, {"x265-params", "log-level=none"}}}};
    case VideoCodec::Vp9:
      return {{"libvpx-vp9", {{"deadline", "realtime"}, {"cpu-used", "8"}, {"crf", crf63}, {"row-mt", "1"}}}};
    case VideoCodec::Av1:
      return {{"libaom-av1", {{"usage", "realtime"}, {"cpu-used", "8"}, {"crf", crf63}}}};
    case VideoCodec::Mjpeg:
      return {{"mjpeg", {}}};
  }
  return {};
}

void set_quality(AVCodecContext& encoder, int quality) {
  encoder.flags |= AV_CODEC_FLAG_QSCALE;  // of encoders without a rate factor
  encoder.global_quality = FF_QP2LAMBDA * std::clamp(quality / 5, 1, 31);
  encoder.qmin = std::min(encoder.qmin, 1);
}

}  // namespace

Result<LibavPtr<AVCodecContext>> open_encoder(const Libav& av, VideoCodec codec, int width_px, int height_px,
                                              AVRational time_base, bool needs_global_header,
                                              bool may_reorder, const VideoWriterOptions& options) {
  std::vector<std::string> tried;
  for (const Encoder& candidate : encoders_of(codec, options.quality)) {
    tried.emplace_back(candidate.name);
    const AVCodec* known = av.avcodec_find_encoder_by_name(candidate.name);
    if (known == nullptr) continue;
    LibavPtr<AVCodecContext> encoder(av.avcodec_alloc_context3(known), {&av});
    if (!encoder) return fail(ErrorCode::LimitExceeded, "not enough memory");
    encoder->width = width_px;
    encoder->height = height_px;
    encoder->pix_fmt = codec == VideoCodec::Mjpeg ? AV_PIX_FMT_YUVJ420P : AV_PIX_FMT_YUV420P;
    encoder->color_range = AVCOL_RANGE_JPEG;
    encoder->colorspace = AVCOL_SPC_SMPTE170M;
    encoder->time_base = time_base;
    encoder->framerate = {static_cast<int>(std::lround(options.rate_hz * 1000)), 1000};
    encoder->gop_size = options.key_interval;
    encoder->bit_rate = 0;
    if (!may_reorder) encoder->max_b_frames = 0;
    if (needs_global_header) encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    for (const auto& [key, value] : candidate.settings)
      av.av_opt_set(encoder->priv_data, key, value.c_str(), 0);
    if (candidate.settings.empty()) set_quality(*encoder, options.quality);
    if (av.avcodec_open2(encoder.get(), known, nullptr) == 0) return encoder;
  }
  return fail(
      ErrorCode::Unsupported,
      fmt::format("the installed libavcodec has no encoder of this kind ({})", fmt::join(tried, ", ")), {},
      "Write .avi, which needs only the encoder of motion JPEG.");
}

}  // namespace waymark::internal

#endif
