#include "waymark/media/video_stream.hpp"

#ifdef WAYMARK_HAVE_LIBAV

#include <cmath>

#include <fmt/format.h>

#include "waymark/media/video_format.hpp"

namespace waymark::internal {
namespace {

// Containers of videos. Not among them: play lists and others that name further files, pictures, and what is
// read from networks and devices.
constexpr const char* kContainers =
    "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpegts,mpeg,h264,hevc,mjpeg,ivf,obu,m4v,flv,ogg,wav,mp3,aac,"
    "flac";

/// Files may name others; those are not opened.
int open_nothing(AVFormatContext* /*context*/, AVIOContext** opened, const char* /*url*/, int /*flags*/,
                 AVDictionary** /*options*/) {
  *opened = nullptr;
  return AVERROR(EPERM);
}

tl::unexpected<Error> no_video(const VideoInput& input, const std::string& why) {
  if (begins_as_video(input.head()))
    return fail(
        ErrorCode::Unreadable, "this video cannot be opened: " + why, {.byte = input.at()},
        "Its index is missing or damaged, as when a recording was not finished or a copy was cut short: "
        "record or copy it again.");
  return fail(ErrorCode::Unreadable, "is no video that can be read: " + why, {},
              "Read are mp4, mov, mkv, webm, avi and MPEG streams.");
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
      av.avformat_open_input(&video.format, nullptr, nullptr, &options);  // frees it when it fails
  av.av_dict_free(&options);
  if (opened < 0) return no_video(*video.input, words_of(av, opened));
  const int known = av.avformat_find_stream_info(video.format, nullptr);
  if (known < 0) return no_video(*video.input, words_of(av, known));
  return {};
}

Status choose_stream(VideoStream& video) {
  const int best = video.av->av_find_best_stream(video.format, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  const bool found = best >= 0;
  if (found) video.stream = video.format->streams[best];
  const bool cover = found && (video.stream->disposition & AV_DISPOSITION_ATTACHED_PIC) != 0;
  if (found && !cover) return {};
  if (video.format->nb_streams == 0) return no_video(*video.input, "it holds no stream");
  return fail(ErrorCode::Unreadable, "holds no moving pictures, only sound or text", {},
              "Give the file with the pictures.");
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
  // Between pictures, whether damage is noticed depends on which thread is first.
  video.codec->thread_type = FF_THREAD_SLICE;
  video.codec->max_pixels = options.max_pixels;
  if (static_cast<std::int64_t>(coded.width) * coded.height > options.max_pixels)
    return fail(ErrorCode::LimitExceeded, fmt::format("pictures of {} x {} pixels; the limit is {}",
                                                      coded.width, coded.height, options.max_pixels));
  const int opened = av.avcodec_open2(video.codec.get(), decoder, nullptr);
  if (opened < 0)
    return fail(ErrorCode::Unsupported,
                fmt::format("'{}' cannot be decoded: {}", name, words_of(av, opened)));
  const AVCodecDescriptor* about = av.avcodec_descriptor_get(coded.codec_id);
  video.predicts = about == nullptr || (about->props & AV_CODEC_PROP_INTRA_ONLY) == 0;
  return {};
}

/// The matrix by which a player moves the pictures.
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

std::optional<Duration> time_of(const Libav& av, std::int64_t ticks, AVRational time_base) {
  if (ticks == AV_NOPTS_VALUE || time_base.num <= 0 || time_base.den <= 0) return std::nullopt;
  constexpr AVRational kNanoseconds = {1, 1'000'000'000};
  constexpr std::int64_t kFarthest = 1'000'000'000'000'000'000;  // 30 years
  const std::int64_t ns = av.av_rescale_q(ticks, time_base, kNanoseconds);
  if (ns < -kFarthest || ns > kFarthest) return std::nullopt;
  return Duration(ns);
}

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

}  // namespace waymark::internal

#endif
