#include "waymark/media/video_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include "waymark/media/video_format.hpp"

#ifdef WAYMARK_HAVE_LIBAV
#include "waymark/media/libav.hpp"

namespace waymark::internal {

/// Problems found in one video, with one entry per kind.
class VideoProblems {
 public:
  explicit VideoProblems(std::string source) : source_(std::move(source)) {}

  /// Counts a problem; the first of a kind keeps its message and place.
  void add(const std::string& key, ErrorCode code, const std::string& message,
           std::optional<std::int64_t> byte = {}, const std::string& hint = {});
  /// Checks whether the images or packets of a file of `size_bytes` end before its stated duration. Must be
  /// called at the end of the file.
  void add_end(const VideoInfo& info, Duration last_image, Duration last_packet, std::int64_t size_bytes);
  /// Reports the rotation that players apply.
  void add_rotation(const VideoInfo& info);
  [[nodiscard]] const std::vector<VideoProblem>& all() const { return all_; }
  [[nodiscard]] const std::string& source() const { return source_; }

 private:
  std::string source_;
  std::vector<VideoProblem> all_{};
};

void VideoProblems::add(const std::string& key, ErrorCode code, const std::string& message,
                        std::optional<std::int64_t> byte, const std::string& hint) {
  const auto entry = std::ranges::find(all_, key, &VideoProblem::key);
  if (entry != all_.end()) {
    ++entry->count;
    return;
  }
  all_.push_back({key, Error{code, message, {.source = source_, .byte = byte}, hint}, 1});
}

void VideoProblems::add_end(const VideoInfo& info, Duration last_image, Duration last_packet,
                            std::int64_t size_bytes) {
  constexpr double kTolerance_s = 0.5;  // sound may last longer than the images
  const double rate_hz = info.mean_rate_hz.value_or(25);
  double expected_s = info.duration ? to_seconds(*info.duration) : 0;
  if (info.frames) expected_s = std::max(expected_s, static_cast<double>(*info.frames) / rate_hz);
  const double missing_s = std::max(kTolerance_s, 2 / rate_hz);
  if (expected_s - to_seconds(last_image) <= missing_s) return;
  if (expected_s - to_seconds(std::max(last_image, last_packet)) > missing_s)
    add("video.truncated", ErrorCode::Unreadable,
        fmt::format("the images end at {:.3f} s of {:.3f} s", to_seconds(last_image), expected_s), size_bytes,
        "The file is truncated, or its end is damaged. Copy it again.");
  else
    add("video.no_whole_image", ErrorCode::Unreadable,
        fmt::format("no intact image between {:.3f} s and the end at {:.3f} s", to_seconds(last_image),
                    expected_s),
        {},
        "They are predicted from damaged data. Copy the file again; a video with more key frames loses "
        "less.");
}

void VideoProblems::add_rotation(const VideoInfo& info) {
  if (info.rotation_deg == 0) return;
  add("video.rotated", ErrorCode::Unsupported,
      fmt::format(
          "has a rotation flag: players rotate its images {:g} degrees clockwise; here the pixels are used "
          "as stored",
          info.rotation_deg),
      {}, "Calibrate the camera with images that are stored the same way.");
}

namespace {

/// "12.345 s".
std::string in_seconds(Duration since_start) { return fmt::format("{:.3f} s", to_seconds(since_start)); }

/// One component of one row, converted to eight bits.
class Component {
 public:
  Component(const AVFrame& frame, const AVPixFmtDescriptor& format, std::size_t which)
      : from_(format.comp[which]),
        data_(frame.data[from_.plane]),
        stride_(frame.linesize[from_.plane]),
        big_endian_((format.flags & AV_PIX_FMT_FLAG_BE) != 0) {}

  [[nodiscard]] bool plain() const { return from_.depth == 8 && from_.shift == 0; }
  [[nodiscard]] const std::uint8_t* row(int y) const {
    return data_ + static_cast<std::ptrdiff_t>(y) * stride_ + from_.offset;
  }
  [[nodiscard]] std::uint8_t at(int x, int y) const {
    const std::uint8_t* sample = row(y) + static_cast<std::ptrdiff_t>(x) * from_.step;
    if (from_.depth + from_.shift <= 8) return scaled(static_cast<unsigned>(*sample) >> from_.shift);
    const unsigned word = big_endian_ ? static_cast<unsigned>(sample[0] << 8 | sample[1])
                                      : static_cast<unsigned>(sample[1] << 8 | sample[0]);
    return scaled(word >> from_.shift);
  }

 private:
  [[nodiscard]] std::uint8_t scaled(unsigned value) const {
    value &= (1U << from_.depth) - 1;
    if (from_.depth >= 8) return static_cast<std::uint8_t>(value >> (from_.depth - 8));
    return static_cast<std::uint8_t>(value * 255 / ((1U << from_.depth) - 1));
  }

  AVComponentDescriptor from_;
  const std::uint8_t* data_;
  std::ptrdiff_t stride_;
  bool big_endian_;
};

void fill_grey(const AVFrame& frame, const AVPixFmtDescriptor& format, Image& storage) {
  const Component luma(frame, format, 0);
  const bool whole_rows = luma.plain() && format.comp[0].step == 1;
  for (int y = 0; y < frame.height; ++y) {
    std::uint8_t* to = storage.row(y);
    if (whole_rows)
      std::memcpy(to, luma.row(y), static_cast<std::size_t>(frame.width));
    else
      for (int x = 0; x < frame.width; ++x) to[x] = luma.at(x, y);
  }
}

void fill_from_rgb(const AVFrame& frame, const AVPixFmtDescriptor& format, Image& storage) {
  const Component r(frame, format, 0), g(frame, format, 1), b(frame, format, 2);
  for (int y = 0; y < frame.height; ++y) {
    std::uint8_t* to = storage.row(y);
    for (int x = 0; x < frame.width; ++x) {
      const unsigned grey = 299U * r.at(x, y) + 587U * g.at(x, y) + 114U * b.at(x, y);
      to[x] = static_cast<std::uint8_t>((grey + 500) / 1000);
    }
  }
}

/// The luma of a decoded image. Returns the image's own plane if it has eight bits and its rows are in order.
/// Otherwise converts the luma into `storage`: rounds deeper samples down to eight bits, unpacks packed
/// formats, applies Rec. 601 to RGB. Fails (Unsupported) on palettes, Bayer patterns, floating point, and
/// images in graphics memory.
Result<ImageView> luma_of(const Libav& av, const AVFrame& frame, Image& storage) {
  const AVPixFmtDescriptor* format = av.av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame.format));
  constexpr std::uint64_t kUnknown = AV_PIX_FMT_FLAG_PAL | AV_PIX_FMT_FLAG_BITSTREAM |
                                     AV_PIX_FMT_FLAG_HWACCEL | AV_PIX_FMT_FLAG_BAYER | AV_PIX_FMT_FLAG_FLOAT;
  if (format == nullptr || (format->flags & kUnknown) != 0 || format->nb_components < 1 ||
      format->comp[0].depth > 16)
    return fail(ErrorCode::Unsupported,
                fmt::format("unsupported pixel format {}", format == nullptr ? "unknown" : format->name));
  if (frame.width <= 0 || frame.height <= 0 || frame.data[0] == nullptr)
    return fail(ErrorCode::Unreadable, "image without pixels");
  const bool rgb = (format->flags & AV_PIX_FMT_FLAG_RGB) != 0 && format->nb_components >= 3;
  const AVComponentDescriptor& luma = format->comp[0];
  const bool as_it_lies = !rgb && luma.depth == 8 && luma.shift == 0 && luma.step == 1 && luma.offset == 0 &&
                          frame.linesize[luma.plane] >= frame.width;
  if (as_it_lies)
    return ImageView{frame.data[luma.plane], frame.width, frame.height, frame.linesize[luma.plane]};
  if (storage.width() != frame.width || storage.height() != frame.height)
    storage = Image(frame.width, frame.height);
  if (rgb)
    fill_from_rgb(frame, *format, storage);
  else
    fill_grey(frame, *format, storage);
  return storage.view();
}

}  // namespace

/// Provides the bytes of a video to libavformat, from one file or from memory, never from other files.
class VideoInput {
 public:
  /// NotFound, Unreadable (folder, empty, no permission), Unsupported (pipe, device).
  [[nodiscard]] static Result<std::unique_ptr<VideoInput>> of_file(const Libav& av,
                                                                   const std::filesystem::path& path);
  [[nodiscard]] static Result<std::unique_ptr<VideoInput>> of_bytes(const Libav& av,
                                                                    std::span<const std::uint8_t> bytes);
  VideoInput(const VideoInput&) = delete;
  VideoInput& operator=(const VideoInput&) = delete;
  ~VideoInput();

  [[nodiscard]] AVIOContext* context() const { return context_; }
  [[nodiscard]] std::int64_t size_bytes() const { return size_; }
  /// Read position; the farthest byte that was requested.
  [[nodiscard]] std::int64_t at() const { return at_; }
  /// The first bytes, at most 400.
  [[nodiscard]] std::span<const std::uint8_t> head() const { return head_; }

 private:
  explicit VideoInput(const Libav& av) : av_(av) {}
  [[nodiscard]] Status prepare();
  static int read(void* self, std::uint8_t* to, int size);
  static std::int64_t seek(void* self, std::int64_t offset, int whence);

  const Libav& av_;
  int file_ = -1;
  std::span<const std::uint8_t> bytes_{};
  std::int64_t size_ = 0;
  std::int64_t at_ = 0;
  std::vector<std::uint8_t> head_{};
  AVIOContext* context_ = nullptr;
};

namespace {

constexpr int kBlock = 1 << 16;

Status check_kind(const struct stat& about) {
  if (S_ISDIR(about.st_mode))
    return fail(ErrorCode::Unreadable, "is a folder, not a video", {}, "Name the video file in it.");
  if (S_ISREG(about.st_mode)) return {};
  const bool pipe = S_ISFIFO(about.st_mode) || S_ISSOCK(about.st_mode);
  return fail(ErrorCode::Unsupported,
              pipe ? "is a pipe; a video must be a file" : "is a device; a video must be a file", {},
              pipe ? "Write it to a file first: cat PIPE > walk.mp4" : "Record a video file first.");
}

}  // namespace

Result<std::unique_ptr<VideoInput>> VideoInput::of_file(const Libav& av, const std::filesystem::path& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0)
    return fail(errno == ENOENT ? ErrorCode::NotFound : ErrorCode::Unreadable,
                fmt::format("cannot open: {}", std::strerror(errno)));
  if (Status kind = check_kind(about); !kind) return tl::unexpected(kind.error());
  std::unique_ptr<VideoInput> input(new VideoInput(av));
  input->file_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (input->file_ < 0)
    return fail(ErrorCode::Unreadable, fmt::format("cannot open: {}", std::strerror(errno)));
  input->size_ = about.st_size;
  if (Status ready = input->prepare(); !ready) return tl::unexpected(ready.error());
  return input;
}

Result<std::unique_ptr<VideoInput>> VideoInput::of_bytes(const Libav& av,
                                                         std::span<const std::uint8_t> bytes) {
  std::unique_ptr<VideoInput> input(new VideoInput(av));
  input->bytes_ = bytes;
  input->size_ = static_cast<std::int64_t>(bytes.size());
  if (Status ready = input->prepare(); !ready) return tl::unexpected(ready.error());
  return input;
}

Status VideoInput::prepare() {
  if (size_ == 0) return fail(ErrorCode::Unreadable, "the file is empty", {}, "Record or copy it again.");
  head_.resize(400);
  const int got = read(this, head_.data(), static_cast<int>(head_.size()));
  head_.resize(static_cast<std::size_t>(std::max(got, 0)));
  at_ = 0;
  auto* buffer = static_cast<unsigned char*>(av_.av_malloc(kBlock));
  if (buffer == nullptr) return fail(ErrorCode::LimitExceeded, "not enough memory");
  context_ = av_.avio_alloc_context(buffer, kBlock, 0, this, read, nullptr, seek);
  if (context_ == nullptr) {
    av_.av_free(buffer);
    return fail(ErrorCode::LimitExceeded, "not enough memory");
  }
  return {};
}

VideoInput::~VideoInput() {
  if (context_ != nullptr) {
    av_.av_freep(static_cast<void*>(&context_->buffer));
    av_.avio_context_free(&context_);
  }
  if (file_ >= 0) ::close(file_);
}

int VideoInput::read(void* opaque, std::uint8_t* to, int size) {
  auto* self = static_cast<VideoInput*>(opaque);
  const std::int64_t left = self->size_ - self->at_;
  if (left <= 0 || size <= 0) return AVERROR_EOF;
  const auto wanted = static_cast<std::size_t>(std::min<std::int64_t>(left, size));
  if (self->file_ < 0) {
    std::memcpy(to, self->bytes_.data() + self->at_, wanted);
    self->at_ += static_cast<std::int64_t>(wanted);
    return static_cast<int>(wanted);
  }
  ssize_t got = -1;
  do {
    got = ::pread(self->file_, to, wanted, self->at_);
  } while (got < 0 && errno == EINTR);
  if (got < 0) return AVERROR(errno);
  if (got == 0) return AVERROR_EOF;  // the file has shrunk since it was opened
  self->at_ += got;
  return static_cast<int>(got);
}

std::int64_t VideoInput::seek(void* opaque, std::int64_t offset, int whence) {
  auto* self = static_cast<VideoInput*>(opaque);
  if ((whence & AVSEEK_SIZE) != 0) return self->size_;
  switch (whence & ~AVSEEK_FORCE) {
    case SEEK_SET:
      break;
    case SEEK_CUR:
      offset += self->at_;
      break;
    case SEEK_END:
      offset += self->size_;
      break;
    default:
      return AVERROR(EINVAL);
  }
  if (offset < 0) return AVERROR(EINVAL);
  self->at_ = offset;
  return offset;
}

/// An open file with its video stream and decoder.
struct VideoStream {
  const Libav* av = nullptr;
  std::unique_ptr<VideoInput> input{};
  AVFormatContext* format = nullptr;
  AVStream* stream = nullptr;
  LibavPtr<AVCodecContext> codec{};
  bool predicts = true;  ///< images are predicted from others
  VideoInfo info{};

  VideoStream() = default;
  VideoStream(const VideoStream&) = delete;
  VideoStream& operator=(const VideoStream&) = delete;
  ~VideoStream();
};

namespace {

/// The time in nanoseconds; empty if it is missing or implausible.
std::optional<Duration> time_of(const Libav& av, std::int64_t ticks, AVRational time_base) {
  if (ticks == AV_NOPTS_VALUE || time_base.num <= 0 || time_base.den <= 0) return std::nullopt;
  constexpr AVRational kNanoseconds = {1, 1'000'000'000};
  constexpr std::int64_t kMaxTime_ns = 1'000'000'000'000'000'000;  // about 30 years
  const std::int64_t ns = av.av_rescale_q(ticks, time_base, kNanoseconds);
  if (ns < -kMaxTime_ns || ns > kMaxTime_ns) return std::nullopt;
  return Duration(ns);
}

// Video containers. Playlists and other formats that refer to other files, image formats, and formats that
// read from networks or devices are excluded.
constexpr const char* kContainers =
    "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpegts,mpeg,h264,hevc,mjpeg,ivf,obu,m4v,flv,ogg,wav,mp3,aac,"
    "flac";

/// A file may refer to other files, which are never opened.
int open_nothing(AVFormatContext* /*context*/, AVIOContext** opened, const char* /*url*/, int /*flags*/,
                 AVDictionary** /*options*/) {
  *opened = nullptr;
  return AVERROR(EPERM);
}

tl::unexpected<Error> no_video(const VideoInput& input, const std::string& why) {
  if (begins_as_video(input.head()))
    return fail(ErrorCode::Unreadable, "this video cannot be opened: " + why, {.byte = input.at()},
                "Its index is missing or damaged, as after an unfinished recording or copy. "
                "Record or copy it again.");
  return fail(ErrorCode::Unreadable, "not a readable video: " + why, {},
              "Supported are mp4, mov, mkv, webm, avi and MPEG streams.");
}

Status open_container(VideoStream& video) {
  const Libav& av = *video.av;
  video.format = av.avformat_alloc_context();
  if (video.format == nullptr) return fail(ErrorCode::LimitExceeded, "not enough memory");
  video.format->pb = video.input->context();
  video.format->flags |= AVFMT_FLAG_CUSTOM_IO;
  video.format->io_open = open_nothing;
  AVDictionary* options = nullptr;
  av.av_dict_set(&options, "format_whitelist", kContainers, 0);
  const int opened =
      av.avformat_open_input(&video.format, nullptr, nullptr, &options);  // frees the format on failure
  av.av_dict_free(&options);
  if (opened < 0) return no_video(*video.input, text_of(av, opened));
  const int found = av.avformat_find_stream_info(video.format, nullptr);
  if (found < 0) return no_video(*video.input, text_of(av, found));
  return {};
}

Status choose_stream(VideoStream& video) {
  const int best = video.av->av_find_best_stream(video.format, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  const bool found = best >= 0;
  if (found) video.stream = video.format->streams[best];
  const bool cover = found && (video.stream->disposition & AV_DISPOSITION_ATTACHED_PIC) != 0;
  if (found && !cover) return {};
  if (video.format->nb_streams == 0) return no_video(*video.input, "it contains no stream");
  return fail(ErrorCode::Unreadable, "contains no video stream, only sound or text", {},
              "Pass the file with the video stream.");
}

Status open_decoder(VideoStream& video, const VideoReaderOptions& options) {
  const Libav& av = *video.av;
  const AVCodecParameters& coded = *video.stream->codecpar;
  const AVCodec* decoder = av.avcodec_find_decoder(coded.codec_id);
  const std::string name = av.avcodec_get_name(coded.codec_id);
  if (decoder == nullptr)
    return fail(ErrorCode::Unsupported, fmt::format("the installed libavcodec does not decode '{}'", name),
                {}, "Convert it: ffmpeg -i VIDEO -c:v libx264 -crf 17 walk.mp4");
  video.codec = LibavPtr<AVCodecContext>(av.avcodec_alloc_context3(decoder), {video.av});
  if (!video.codec || av.avcodec_parameters_to_context(video.codec.get(), &coded) < 0)
    return fail(ErrorCode::LimitExceeded, "not enough memory");
  video.codec->pkt_timebase = video.stream->time_base;
  video.codec->thread_count = options.threads;
  // With frame threading, whether damage is detected depends on the order in which threads run.
  video.codec->thread_type = FF_THREAD_SLICE;
  video.codec->max_pixels = options.max_pixels;
  if (static_cast<std::int64_t>(coded.width) * coded.height > options.max_pixels)
    return fail(ErrorCode::LimitExceeded, fmt::format("images of {} x {} pixels; the limit is {}",
                                                      coded.width, coded.height, options.max_pixels));
  const int opened = av.avcodec_open2(video.codec.get(), decoder, nullptr);
  if (opened < 0)
    return fail(ErrorCode::Unsupported, fmt::format("'{}' cannot be decoded: {}", name, text_of(av, opened)));
  const AVCodecDescriptor* about = av.avcodec_descriptor_get(coded.codec_id);
  video.predicts = about == nullptr || (about->props & AV_CODEC_PROP_INTRA_ONLY) == 0;
  return {};
}

/// The matrix by which a player transforms the images.
const std::int32_t* display_matrix(const AVStream& stream) {
#if LIBAVCODEC_VERSION_INT >= AV_VERSION_INT(60, 30, 100)
  for (int i = 0; i < stream.codecpar->nb_coded_side_data; ++i) {
    const AVPacketSideData& data = stream.codecpar->coded_side_data[i];
#else
  for (int i = 0; i < stream.nb_side_data; ++i) {
    const AVPacketSideData& data = stream.side_data[i];
#endif
    constexpr std::size_t kMatrix = 9 * sizeof(std::int32_t);
    if (data.type == AV_PKT_DATA_DISPLAYMATRIX && data.size >= kMatrix)
      return reinterpret_cast<const std::int32_t*>(data.data);
  }
  return nullptr;
}

double rotation_of(const Libav& av, const AVStream& stream) {
  const std::int32_t* matrix = display_matrix(stream);
  if (matrix == nullptr) return 0;
  const double counterclockwise_deg = av.av_display_rotation_get(matrix);
  if (!std::isfinite(counterclockwise_deg)) return 0;
  const double clockwise = std::fmod(360 - counterclockwise_deg, 360);
  return std::round(clockwise * 1e3) / 1e3;
}

void describe(VideoStream& video) {
  const Libav& av = *video.av;
  const AVStream& stream = *video.stream;
  VideoInfo& info = video.info;
  info.container = video.format->iformat->name;
  info.codec = av.avcodec_get_name(stream.codecpar->codec_id);
  info.width_px = stream.codecpar->width;
  info.height_px = stream.codecpar->height;
  info.rotation_deg = rotation_of(av, stream);
  const AVRational rate = stream.avg_frame_rate;
  if (rate.num > 0 && rate.den > 0) info.mean_rate_hz = static_cast<double>(rate.num) / rate.den;
  info.duration = time_of(av, stream.duration, stream.time_base);
  if (!info.duration) info.duration = time_of(av, video.format->duration, {1, AV_TIME_BASE});
  if (info.duration && info.duration->count() <= 0) info.duration.reset();
  if (stream.nb_frames > 0) info.frames = stream.nb_frames;
}

}  // namespace

VideoStream::~VideoStream() {
  codec.reset();
  if (format != nullptr) av->avformat_close_input(&format);
}

namespace {

Result<std::unique_ptr<VideoStream>> open_stream(std::unique_ptr<VideoInput> input,
                                                 const VideoReaderOptions& options) {
  const Result<const Libav*> av = libav();
  if (!av) return tl::unexpected(av.error());
  if (Status sound = check_ranges(options); !sound) return tl::unexpected(sound.error());
  auto video = std::make_unique<VideoStream>();
  video->av = *av;
  video->input = std::move(input);
  Status status = open_container(*video);
  if (status) status = choose_stream(*video);
  if (status) status = open_decoder(*video, options);
  if (!status) return tl::unexpected(status.error());
  describe(*video);
  return video;
}

}  // namespace
}  // namespace waymark::internal
#endif

namespace waymark {

#ifdef WAYMARK_HAVE_LIBAV

using namespace internal;  // NOLINT(google-build-using-namespace): of this file

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
  std::optional<Duration> origin{};  ///< origin of the stamps
  std::optional<Duration> last{};    ///< stamp of the previous image
  std::optional<Duration> read{};    ///< latest packet time, whether intact or damaged
  std::int64_t delivered = 0;
  int failures = 0;  ///< consecutive read errors
  bool wait_for_key = false;
  bool drained = false;  ///< the decoder has been flushed, so no packets follow
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

/// Records damage; images predicted from the damaged one are skipped too.
void VideoReader::Impl::skip(const std::string& why, std::int64_t byte) {
  const std::string when = last ? "after " + in_seconds(*last) : "at the beginning";
  problems.add("video.damaged", ErrorCode::Unreadable,
               fmt::format("damaged {}: {}; images up to the next intact one are skipped", when, why),
               byte >= 0 ? std::optional(byte) : std::nullopt);
  wait_for_key = video->predicts;
}

void VideoReader::Impl::note_time(const AVPacket& ours) {
  const std::int64_t ticks = ours.pts == AV_NOPTS_VALUE ? ours.dts : ours.pts;
  const std::optional<Duration> time = time_of(av, ticks, video->stream->time_base);
  if (time) read = std::max(read.value_or(*time), *time);
}

/// Passes the next packet of the stream to the decoder, or flushes it if there is none.
Status VideoReader::Impl::feed() {
  constexpr int kMaxFailures = 100;
  while (!drained) {
    const int got = av.av_read_frame(video->format, packet.get());
    if (got < 0 && got != AVERROR_EOF && got != AVERROR(EAGAIN) && ++failures < kMaxFailures) {
      skip(text_of(av, got), video->input->at());
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
    if (sent < 0) skip(text_of(av, sent), byte);
    if (ours) return {};
  }
  return {};
}

/// Whether the decoded image is intact.
bool VideoReader::Impl::is_whole() {
  const bool broken = frame->decode_error_flags != 0 || (frame->flags & AV_FRAME_FLAG_CORRUPT) != 0;
  if (broken) skip("an image is incomplete", -1);
  if (wait_for_key && !broken && is_key_frame(*frame)) wait_for_key = false;
  return !broken && !wait_for_key;
}

/// Sets `last`; returns false if the image is not later than the previous one.
bool VideoReader::Impl::stamp_frame() {
  const AVRational base = video->stream->time_base;
  std::optional<Duration> time = time_of(av, frame->best_effort_timestamp, base);
  if (!time) {
    problems.add("video.no_stamps", ErrorCode::Unreadable,
                 "images without time stamps; assumed to be equally spaced at the mean rate");
    const double rate_hz = std::clamp(video->info.mean_rate_hz.value_or(25), 1e-3, 1e6);
    const auto step = Duration(static_cast<std::int64_t>(1e9 / rate_hz));
    time = (origin ? *origin : Duration{}) + (last ? *last + step : Duration{});
  }
  if (!origin) {  // the first image; if that was skipped, the start of the stream
    const auto start = time_of(av, video->stream->start_time, base);
    origin = !problems.all().empty() && start && *start < *time ? *start : *time;
  }
  const Duration stamp = *time - *origin;
  if (last && stamp <= *last) {
    problems.add(
        "video.order", ErrorCode::Unreadable,
        fmt::format("an image at {} follows one at {} and is skipped", in_seconds(stamp), in_seconds(*last)));
    return false;
  }
  if (last) note_gap(*last, stamp);
  last = stamp;
  return true;
}

void VideoReader::Impl::note_gap(Duration from, Duration to) {
  if (to_seconds(to - from) > options.gap_s)
    problems.add("video.gap", ErrorCode::Unreadable,
                 fmt::format("no image between {} and {}", in_seconds(from), in_seconds(to)));
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
      skip(text_of(av, got), -1);
      constexpr int kMaxFailures = 1000;
      ended = ++failures > kMaxFailures;
      continue;
    }
    if (!is_whole() || !stamp_frame()) continue;
    const Result<ImageView> luma = luma_of(av, *frame, storage);
    if (!luma) return tl::unexpected(luma.error());
    if (is_interlaced(*frame))
      problems.add(
          "video.interlaced", ErrorCode::Unsupported,
          "images are interlaced: odd and even rows are exposed at different times, which distorts edges", {},
          "Record progressive video.");
    if (luma->width != video->info.width_px || luma->height != video->info.height_px)
      problems.add("video.size_changes", ErrorCode::Unsupported,
                   fmt::format("an image has {} x {} pixels, the video {} x {}", luma->width, luma->height,
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
  return fail(ErrorCode::Unsupported, "this build has no video support", {.source = name},
              "Install libavformat-dev, libavcodec-dev and libavutil-dev, and rebuild.");
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
