#include "waymark/media/video_writer.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/media/video_format.hpp"

#ifdef WAYMARK_HAVE_LIBAV
#include "waymark/media/libav.hpp"

namespace waymark::internal {
namespace {

/// An image in the layout that encoders require: a luma plane, and two chroma planes with half its width and
/// height; full range.
struct Yuv420 {
  std::uint8_t* y = nullptr;
  std::uint8_t* cb = nullptr;
  std::uint8_t* cr = nullptr;
  std::ptrdiff_t y_stride = 0, cb_stride = 0, cr_stride = 0;
  int width = 0, height = 0;  ///< even; the last column or row is repeated if necessary
};

constexpr std::uint8_t kNoColor = 128;

/// 128 plus a weighted sum of four pixels, with weights in units of 1e-4.
std::uint8_t chroma(int sum) {
  constexpr int kShare = 4 * 10'000;
  const int rounded = (sum + (sum >= 0 ? kShare / 2 : -kShare / 2)) / kShare;
  return static_cast<std::uint8_t>(std::clamp(128 + rounded, 0, 255));
}

void fill(const ImageView& image, const Yuv420& to) {
  for (int y = 0; y < to.height; ++y) {
    std::uint8_t* row = to.y + y * to.y_stride;
    const std::uint8_t* from = image.row(std::min(y, image.height - 1));
    const int width = std::min(image.width, to.width);
    std::memcpy(row, from, static_cast<std::size_t>(width));
    std::fill(row + width, row + to.width, from[width - 1]);
  }
  for (int y = 0; y < to.height / 2; ++y) {
    std::fill_n(to.cb + y * to.cb_stride, to.width / 2, kNoColor);
    std::fill_n(to.cr + y * to.cr_stride, to.width / 2, kNoColor);
  }
}

/// Converts to Rec. 601; each chroma value is the mean over four pixels.
void fill(const ColorImage& image, const Yuv420& to) {
  const auto pixel = [&](int x, int y) {
    return image.row(std::min(y, image.height() - 1))[std::min(x, image.width() - 1)];
  };
  for (int y = 0; y < to.height; ++y) {
    std::uint8_t* row = to.y + y * to.y_stride;
    for (int x = 0; x < to.width; ++x) {
      const Rgb p = pixel(x, y);
      row[x] = static_cast<std::uint8_t>((299 * p.r + 587 * p.g + 114 * p.b + 500) / 1000);
    }
  }
  for (int y = 0; y < to.height / 2; ++y) {
    for (int x = 0; x < to.width / 2; ++x) {
      int r = 0, g = 0, b = 0;
      for (int k = 0; k < 4; ++k) {
        const Rgb p = pixel(2 * x + k % 2, 2 * y + k / 2);
        r += p.r;
        g += p.g;
        b += p.b;
      }
      to.cb[y * to.cb_stride + x] = chroma(-1687 * r - 3313 * g + 5000 * b);
      to.cr[y * to.cr_stride + x] = chroma(5000 * r - 4187 * g - 813 * b);
    }
  }
}

struct Encoder {
  const char* name;
  std::vector<std::pair<const char*, std::string>> settings;
};

/// Encoders for a codec, in order of preference; the caller skips those missing from a build.
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
  encoder.flags |= AV_CODEC_FLAG_QSCALE;  // for encoders without a rate factor
  encoder.global_quality = FF_QP2LAMBDA * std::clamp(quality / 5, 1, 31);
  encoder.qmin = std::min(encoder.qmin, 1);
}

/// Opens the first installed encoder for this codec. The container determines `needs_global_header` and
/// `may_reorder` (whether images may be predicted from later ones).
Result<LibavPtr<AVCodecContext>> open_encoder(const Libav& av, VideoCodec codec, int width_px, int height_px,
                                              AVRational time_base, bool needs_global_header,
                                              bool may_reorder, const VideoWriterOptions& options) {
  std::vector<std::string> tried;
  for (const Encoder& candidate : encoders_of(codec, options.quality)) {
    tried.emplace_back(candidate.name);
    const AVCodec* found = av.avcodec_find_encoder_by_name(candidate.name);
    if (found == nullptr) continue;
    LibavPtr<AVCodecContext> encoder(av.avcodec_alloc_context3(found), {&av});
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
    if (av.avcodec_open2(encoder.get(), found, nullptr) == 0) return encoder;
  }
  return fail(
      ErrorCode::Unsupported,
      fmt::format("the installed libavcodec has no encoder of this kind ({})", fmt::join(tried, ", ")), {},
      "Write .avi, which needs only the motion JPEG encoder.");
}

}  // namespace
}  // namespace waymark::internal
#endif

namespace waymark {

#ifdef WAYMARK_HAVE_LIBAV

using namespace internal;  // NOLINT(google-build-using-namespace): of this file

struct VideoWriter::Impl {
  Impl(const Libav& libraries, std::filesystem::path to)
      : av(libraries),
        path(std::move(to)),
        beside(fmt::format("{}.{}.part", path.string(), ::getpid())),
        packet(av.av_packet_alloc(), {&av}),
        frame(av.av_frame_alloc(), {&av}) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl();

  [[nodiscard]] Status open(int width, int height, const VideoWriterOptions& options);
  [[nodiscard]] Status add_rotation(double clockwise_deg);
  template <class AnyImage>
  [[nodiscard]] Status add(const AnyImage& image, int width, int height, SensorTime stamp);
  [[nodiscard]] Status encode(AVFrame* image);
  [[nodiscard]] Status close();
  [[nodiscard]] tl::unexpected<Error> unwritable(int error) const {
    return fail(ErrorCode::Unwritable, "cannot write the video: " + text_of(av, error),
                {.source = path.string()});
  }

  const Libav& av;
  std::filesystem::path path;
  std::filesystem::path beside;
  AVFormatContext* format = nullptr;
  AVStream* stream = nullptr;
  LibavPtr<AVCodecContext> encoder{};
  LibavPtr<AVPacket> packet;
  LibavPtr<AVFrame> frame;
  int width_px = 0, height_px = 0;
  std::optional<SensorTime> first{};
  SensorTime last{};
  std::int64_t last_ticks = -1;
  bool begun = false;  ///< the header has been written
  bool done = false;
};

namespace {

AVRational time_base_of(const std::string& suffix, double rate_hz) {
  if (suffix == ".avi") return {1000, static_cast<int>(std::lround(rate_hz * 1000))};
  return {1, 1'000'000};
}

VideoCodec codec_for(const std::string& suffix) {
  if (suffix == ".webm") return VideoCodec::Vp9;
  return suffix == ".avi" ? VideoCodec::Mjpeg : VideoCodec::H264;
}

Status check(const std::filesystem::path& path, int width_px, int height_px,
             const VideoWriterOptions& options) {
  const Place place{.source = path.string()};
  if (!is_video_name(path.string()))
    return fail(ErrorCode::InvalidArgument, "unsupported suffix of a video", place,
                "Use .mp4, .mov, .mkv, .webm or .avi.");
  constexpr int kMaxSide_px = 16384;
  if (width_px < 2 || height_px < 2 || width_px > kMaxSide_px || height_px > kMaxSide_px)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("images of {} x {} pixels cannot be written as a video", width_px, height_px),
                place, fmt::format("Sides must be 2 to {} pixels.", kMaxSide_px));
  if (!(options.rate_hz >= 0.1 && options.rate_hz <= 10'000) || options.quality < 0 || options.quality > 51)
    return fail(ErrorCode::InvalidArgument, "invalid rate or quality", place);
  return {};
}

}  // namespace

VideoWriter::Impl::~Impl() {
  if (format == nullptr) return;
  if (format->pb != nullptr) av.avio_closep(&format->pb);
  av.avformat_free_context(format);
  std::error_code ignored;
  if (!done) std::filesystem::remove(beside, ignored);
}

/// Stores the rotation for players; it is lost in containers without a field for it.
Status VideoWriter::Impl::add_rotation(double clockwise_deg) {
  if (clockwise_deg == 0) return {};
  constexpr std::size_t kMatrix = 9 * sizeof(std::int32_t);
#if LIBAVCODEC_VERSION_INT >= AV_VERSION_INT(60, 30, 100)
  AVPacketSideData* side =
      av.av_packet_side_data_new(&stream->codecpar->coded_side_data, &stream->codecpar->nb_coded_side_data,
                                 AV_PKT_DATA_DISPLAYMATRIX, kMatrix, 0);
  std::uint8_t* matrix = side == nullptr ? nullptr : side->data;
#else
  std::uint8_t* matrix = av.av_stream_new_side_data(stream, AV_PKT_DATA_DISPLAYMATRIX, kMatrix);
#endif
  if (matrix == nullptr) return fail(ErrorCode::LimitExceeded, "not enough memory");
  av.av_display_rotation_set(reinterpret_cast<std::int32_t*>(matrix), clockwise_deg);
  return {};
}

Status VideoWriter::Impl::open(int width, int height, const VideoWriterOptions& options) {
  width_px = width;
  height_px = height;
  const std::string suffix = path.extension().string();
  const int made = av.avformat_alloc_output_context2(&format, nullptr, nullptr, path.c_str());
  if (made < 0) return unwritable(made);
  stream = av.avformat_new_stream(format, nullptr);
  if (stream == nullptr) return fail(ErrorCode::LimitExceeded, "not enough memory");
  const bool global = (format->oformat->flags & AVFMT_GLOBALHEADER) != 0;
  auto opened =
      open_encoder(av, options.codec.value_or(codec_for(suffix)), (width + 1) & ~1, (height + 1) & ~1,
                   time_base_of(suffix, options.rate_hz), global, suffix != ".avi", options);
  if (!opened) return tl::unexpected(opened.error());
  encoder = std::move(*opened);
  stream->time_base = encoder->time_base;
  stream->avg_frame_rate = encoder->framerate;
  if (const int error = av.avcodec_parameters_from_context(stream->codecpar, encoder.get()); error < 0)
    return unwritable(error);
  if (Status turned = add_rotation(options.rotation_deg); !turned) return turned;
  frame->format = encoder->pix_fmt;
  frame->width = encoder->width;
  frame->height = encoder->height;
  frame->color_range = encoder->color_range;
  if (const int error = av.av_frame_get_buffer(frame.get(), 0); error < 0) return unwritable(error);
  const std::string url = "file:" + beside.string();
  if (const int error = av.avio_open(&format->pb, url.c_str(), AVIO_FLAG_WRITE); error < 0)
    return unwritable(error);
  const int error = av.avformat_write_header(format, nullptr);
  begun = error >= 0;
  return begun ? Status() : unwritable(error);
}

/// Passes an image to the encoder (nullptr flushes it) and writes the encoder's packets to the file.
Status VideoWriter::Impl::encode(AVFrame* image) {
  int got = av.avcodec_send_frame(encoder.get(), image);
  while (got >= 0) {
    got = av.avcodec_receive_packet(encoder.get(), packet.get());
    if (got == AVERROR(EAGAIN) || got == AVERROR_EOF) return {};
    if (got < 0) break;
    packet->stream_index = stream->index;
    av.av_packet_rescale_ts(packet.get(), encoder->time_base, stream->time_base);
    got = av.av_interleaved_write_frame(format, packet.get());
  }
  return got < 0 ? unwritable(got) : Status();
}

template <class AnyImage>
Status VideoWriter::Impl::add(const AnyImage& image, int width, int height, SensorTime stamp) {
  if (width != width_px || height != height_px)
    return fail(
        ErrorCode::InvalidArgument,
        fmt::format("an image of {} x {} pixels in a video of {} x {}", width, height, width_px, height_px),
        {.source = path.string()});
  if (first && stamp <= last)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the image stamps do not increase at {:.6f} s", to_seconds(stamp - *first)),
                {.source = path.string()});
  if (!first) first = stamp;
  last = stamp;
  const AVRational base = encoder->time_base;
  last_ticks =
      std::max<std::int64_t>(last_ticks + 1, std::llround(to_seconds(stamp - *first) * base.den / base.num));
  if (const int error = av.av_frame_make_writable(frame.get()); error < 0) return unwritable(error);
  fill(image, Yuv420{frame->data[0], frame->data[1], frame->data[2], frame->linesize[0], frame->linesize[1],
                     frame->linesize[2], frame->width, frame->height});
  frame->pts = last_ticks;
  if (encoder->global_quality != 0) frame->quality = encoder->global_quality;
  return encode(frame.get());
}

Status VideoWriter::Impl::close() {
  if (done) return {};
  if (Status rest = encode(nullptr); !rest) return rest;
  if (const int error = av.av_write_trailer(format); error < 0) return unwritable(error);
  if (const int error = av.avio_closep(&format->pb); error < 0) return unwritable(error);
  std::error_code error;
  std::filesystem::rename(beside, path, error);
  if (error) return fail(ErrorCode::Unwritable, error.message(), {.source = path.string()});
  done = true;
  return {};
}

Result<VideoWriter> VideoWriter::create(const std::filesystem::path& path, int width_px, int height_px,
                                        const VideoWriterOptions& options) {
  if (Status sound = check(path, width_px, height_px, options); !sound) return tl::unexpected(sound.error());
  const Result<const Libav*> av = libav();
  if (!av) return tl::unexpected(av.error());
  auto impl = std::make_unique<Impl>(**av, path);
  Status opened = impl->open(width_px, height_px, options);
  if (!opened) {
    if (opened.error().place.source.empty()) opened.error().place.source = path.string();
    return tl::unexpected(opened.error());
  }
  return VideoWriter(std::move(impl));
}

Status VideoWriter::add(const ImageView& image, SensorTime stamp) {
  return impl_->add(image, image.width, image.height, stamp);
}
Status VideoWriter::add(const ColorImage& image, SensorTime stamp) {
  return impl_->add(image, image.width(), image.height(), stamp);
}
Status VideoWriter::close() { return impl_->close(); }

#else

struct VideoWriter::Impl {};

Result<VideoWriter> VideoWriter::create(const std::filesystem::path& path, int /*width_px*/,
                                        int /*height_px*/, const VideoWriterOptions& /*options*/) {
  return fail(ErrorCode::Unsupported, "this build has no video support", {.source = path.string()},
              "Install libavformat-dev, libavcodec-dev and libavutil-dev, and rebuild.");
}
Status VideoWriter::add(const ImageView& /*image*/, SensorTime /*stamp*/) { return {}; }
Status VideoWriter::add(const ColorImage& /*image*/, SensorTime /*stamp*/) { return {}; }
Status VideoWriter::close() { return {}; }

#endif

VideoWriter::VideoWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VideoWriter::VideoWriter(VideoWriter&&) noexcept = default;
VideoWriter& VideoWriter::operator=(VideoWriter&&) noexcept = default;
VideoWriter::~VideoWriter() = default;

}  // namespace waymark
