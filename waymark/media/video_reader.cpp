#include "waymark/media/video_reader.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "waymark/media/video_problems.hpp"

#ifdef WAYMARK_HAVE_LIBAV
#include "waymark/media/luma_plane.hpp"
#include "waymark/media/video_stream.hpp"
#endif

namespace waymark {

#ifdef WAYMARK_HAVE_LIBAV

using namespace internal;  // NOLINT(google-build-using-namespace): this file is their other half

struct VideoReader::Impl {
  Impl(std::unique_ptr<VideoStream> opened, std::string name, const VideoReaderOptions& chosen)
      : video(std::move(opened)),
        av(*video->av),
        packet(av.av_packet_alloc(), {&av}),
        frame(av.av_frame_alloc(), {&av}),
        options(chosen),
        problems(std::move(name)) {}

  Result<std::optional<VideoFrame>> next();
  [[nodiscard]] Status feed();
  void note_time(const AVPacket& ours);
  void skip(const std::string& why, std::int64_t byte);
  [[nodiscard]] bool is_whole();
  [[nodiscard]] bool stamp_frame();
  void note_gap(Duration from, Duration to);

  std::unique_ptr<VideoStream> video;
  const Libav& av;
  LibavPtr<AVPacket> packet;
  LibavPtr<AVFrame> frame;
  VideoReaderOptions options;
  VideoProblems problems;
  Image storage{};
  std::optional<Duration> origin{};  ///< of the stamps
  std::optional<Duration> last{};    ///< stamp of the picture before
  std::optional<Duration> read{};    ///< newest time of a packet, whole or damaged
  std::int64_t delivered = 0;
  int failures = 0;  ///< of reading, one after the other
  bool wait_for_key = false;
  bool drained = false;  ///< the decoder was told that no packet follows
  bool ended = false;
};

namespace {

bool is_key_frame(const AVFrame& frame) {
#ifdef AV_FRAME_FLAG_KEY
  return (frame.flags & AV_FRAME_FLAG_KEY) != 0;
#else
  return frame.key_frame != 0;
#endif
}

bool is_interlaced(const AVFrame& frame) {
#ifdef AV_FRAME_FLAG_INTERLACED
  return (frame.flags & AV_FRAME_FLAG_INTERLACED) != 0;
#else
  return frame.interlaced_frame != 0;
#endif
}

}  // namespace

/// Something is damaged: what is predicted from it is not used either.
void VideoReader::Impl::skip(const std::string& why, std::int64_t byte) {
  const std::string when = last ? "after " + in_seconds(*last) : "at the beginning";
  problems.add("video.damaged", ErrorCode::Unreadable,
               fmt::format("damaged {}: {}; pictures up to the next whole one are left out", when, why),
               byte >= 0 ? std::optional(byte) : std::nullopt);
  wait_for_key = video->predicts;
}

void VideoReader::Impl::note_time(const AVPacket& ours) {
  const std::int64_t ticks = ours.pts == AV_NOPTS_VALUE ? ours.dts : ours.pts;
  const std::optional<Duration> time = time_of(av, ticks, video->stream->time_base);
  if (time) read = std::max(read.value_or(*time), *time);
}

/// Gives the decoder the next packet of the stream, or tells it that there is none.
Status VideoReader::Impl::feed() {
  constexpr int kMostFailures = 100;
  while (!drained) {
    const int got = av.av_read_frame(video->format, packet.get());
    if (got < 0 && got != AVERROR_EOF && got != AVERROR(EAGAIN) && ++failures < kMostFailures) {
      skip(words_of(av, got), video->input->at());
      continue;
    }
    if (got < 0) {
      drained = true;
      av.avcodec_send_packet(video->codec.get(), nullptr);
      return {};
    }
    failures = 0;
    const bool ours = packet->stream_index == video->stream->index;
    const bool corrupt = ours && (packet->flags & AV_PKT_FLAG_CORRUPT) != 0;
    const std::int64_t byte = packet->pos;
    if (ours) note_time(*packet);
    if (corrupt) skip("a packet is marked as damaged", byte);
    const int sent = ours ? av.avcodec_send_packet(video->codec.get(), packet.get()) : 0;
    av.av_packet_unref(packet.get());
    if (sent == AVERROR(ENOMEM)) return fail(ErrorCode::LimitExceeded, "not enough memory");
    if (sent < 0) skip(words_of(av, sent), byte);
    if (ours) return {};
  }
  return {};
}

/// Whether the decoded picture shows what was filmed.
bool VideoReader::Impl::is_whole() {
  const bool broken = frame->decode_error_flags != 0 || (frame->flags & AV_FRAME_FLAG_CORRUPT) != 0;
  if (broken) skip("a picture lacks parts", -1);
  if (wait_for_key && !broken && is_key_frame(*frame)) wait_for_key = false;
  return !broken && !wait_for_key;
}

/// Fills in `last`; false when the picture does not come after the one before.
bool VideoReader::Impl::stamp_frame() {
  const AVRational base = video->stream->time_base;
  std::optional<Duration> time = time_of(av, frame->best_effort_timestamp, base);
  if (!time) {
    problems.add("video.no_stamps", ErrorCode::Unreadable,
                 "pictures without time stamps; they are taken to follow each other at the mean rate");
    const double rate_hz = std::clamp(video->info.mean_rate_hz.value_or(25), 1e-3, 1e6);
    const auto step = Duration(static_cast<std::int64_t>(1e9 / rate_hz));
    time = (origin ? *origin : Duration{}) + (last ? *last + step : Duration{});
  }
  if (!origin) {  // the first picture; where that was left out, the start of the stream
    const auto start = time_of(av, video->stream->start_time, base);
    origin = !problems.all().empty() && start && *start < *time ? *start : *time;
  }
  const Duration stamp = *time - *origin;
  if (last && stamp <= *last) {
    problems.add("video.order", ErrorCode::Unreadable,
                 fmt::format("a picture at {} comes after one at {} and is left out", in_seconds(stamp),
                             in_seconds(*last)));
    return false;
  }
  if (last) note_gap(*last, stamp);
  last = stamp;
  return true;
}

void VideoReader::Impl::note_gap(Duration from, Duration to) {
  if (to_seconds(to - from) > options.gap_s)
    problems.add("video.gap", ErrorCode::Unreadable,
                 fmt::format("no picture between {} and {}", in_seconds(from), in_seconds(to)));
}

Result<std::optional<VideoFrame>> VideoReader::Impl::next() {
  while (!ended) {
    const int got = av.avcodec_receive_frame(video->codec.get(), frame.get());
    if (got == AVERROR(EAGAIN)) {
      if (Status fed = feed(); !fed) return tl::unexpected(fed.error());
      continue;
    }
    if (got == AVERROR_EOF) {
      ended = true;
      const Duration first = origin.value_or(Duration{});
      problems.add_end(video->info, last.value_or(Duration{}), read ? *read - first : Duration{},
                       video->input->size_bytes());
      problems.add_rotation(video->info);
      break;
    }
    if (got == AVERROR(ENOMEM)) return fail(ErrorCode::LimitExceeded, "not enough memory");
    if (got < 0) {
      skip(words_of(av, got), -1);
      constexpr int kMostFailures = 1000;
      ended = ++failures > kMostFailures;
      continue;
    }
    if (!is_whole() || !stamp_frame()) continue;
    const Result<ImageView> luma = luma_of(av, *frame, storage);
    if (!luma) return tl::unexpected(luma.error());
    if (is_interlaced(*frame))
      problems.add("video.interlaced", ErrorCode::Unsupported,
                   "pictures are interlaced: their odd and even rows are of two times, which bends edges", {},
                   "Record progressive video.");
    if (luma->width != video->info.width_px || luma->height != video->info.height_px)
      problems.add("video.size_changes", ErrorCode::Unsupported,
                   fmt::format("a picture has {} x {} pixels, the video {} x {}", luma->width, luma->height,
                               video->info.width_px, video->info.height_px));
    return VideoFrame{*luma, SensorTime(*last), delivered++, is_key_frame(*frame)};
  }
  return std::optional<VideoFrame>();
}

namespace {

Result<VideoReader> placed(Result<VideoReader> reader, const std::string& name) {
  if (!reader && reader.error().place.source.empty()) reader.error().place.source = name;
  return reader;
}

}  // namespace

Result<VideoReader> VideoReader::open(const std::filesystem::path& path, const VideoReaderOptions& options) {
  const Result<const Libav*> av = libav();
  Result<std::unique_ptr<VideoInput>> input =
      av ? VideoInput::of_file(**av, path) : tl::unexpected(av.error());
  Result<std::unique_ptr<VideoStream>> video =
      input ? open_stream(std::move(*input), options) : tl::unexpected(input.error());
  if (!video) return placed(tl::unexpected(video.error()), path.string());
  return VideoReader(std::make_unique<Impl>(std::move(*video), path.string(), options));
}

Result<VideoReader> VideoReader::open(std::span<const std::uint8_t> bytes, const std::string& name,
                                      const VideoReaderOptions& options) {
  const Result<const Libav*> av = libav();
  Result<std::unique_ptr<VideoInput>> input =
      av ? VideoInput::of_bytes(**av, bytes) : tl::unexpected(av.error());
  Result<std::unique_ptr<VideoStream>> video =
      input ? open_stream(std::move(*input), options) : tl::unexpected(input.error());
  if (!video) return placed(tl::unexpected(video.error()), name);
  return VideoReader(std::make_unique<Impl>(std::move(*video), name, options));
}

const VideoInfo& VideoReader::info() const { return impl_->video->info; }

Result<std::optional<VideoFrame>> VideoReader::next() {
  auto frame = impl_->next();
  if (!frame && frame.error().place.source.empty()) frame.error().place.source = impl_->problems.source();
  return frame;
}

const std::vector<VideoProblem>& VideoReader::problems() const { return impl_->problems.all(); }

double VideoReader::progress() const {
  const VideoInput& input = *impl_->video->input;
  return std::clamp(static_cast<double>(input.at()) / static_cast<double>(input.size_bytes()), 0.0, 1.0);
}

#else

struct VideoReader::Impl {
  VideoInfo info{};
  std::vector<VideoProblem> problems{};
};

namespace {

tl::unexpected<Error> not_built(const std::string& name) {
  return fail(ErrorCode::Unsupported, "this build reads no video files", {.source = name},
              "Install libavformat-dev, libavcodec-dev and libavutil-dev, and build again.");
}

}  // namespace

Result<VideoReader> VideoReader::open(const std::filesystem::path& path,
                                      const VideoReaderOptions& /*options*/) {
  return not_built(path.string());
}
Result<VideoReader> VideoReader::open(std::span<const std::uint8_t> /*bytes*/, const std::string& name,
                                      const VideoReaderOptions& /*options*/) {
  return not_built(name);
}
const VideoInfo& VideoReader::info() const { return impl_->info; }
Result<std::optional<VideoFrame>> VideoReader::next() { return std::optional<VideoFrame>(); }
const std::vector<VideoProblem>& VideoReader::problems() const { return impl_->problems; }
double VideoReader::progress() const { return 1; }

#endif

VideoReader::VideoReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VideoReader::VideoReader(VideoReader&&) noexcept = default;
VideoReader& VideoReader::operator=(VideoReader&&) noexcept = default;
VideoReader::~VideoReader() = default;

}  // namespace waymark
