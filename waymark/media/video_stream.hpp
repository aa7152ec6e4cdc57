#pragma once

#ifdef WAYMARK_HAVE_LIBAV

#include <memory>
#include <string>

#include "waymark/media/libav.hpp"
#include "waymark/media/video_input.hpp"
#include "waymark/media/video_reader.hpp"

namespace waymark::internal {

/// A file whose stream of pictures was found and whose decoder is open.
struct VideoStream {
  const Libav* av = nullptr;
  std::unique_ptr<VideoInput> input{};
  AVFormatContext* format = nullptr;
  AVStream* stream = nullptr;
  LibavPtr<AVCodecContext> codec{};
  bool predicts = true;  ///< pictures are predicted from others
  VideoInfo info{};

  VideoStream() = default;
  VideoStream(const VideoStream&) = delete;
  VideoStream& operator=(const VideoStream&) = delete;
  ~VideoStream();
};

[[nodiscard]] Result<std::unique_ptr<VideoStream>> open_stream(std::unique_ptr<VideoInput> input,
                                                               const VideoReaderOptions& options);

/// In nanoseconds; nothing where there is no time, or an absurd one.
[[nodiscard]] std::optional<Duration> time_of(const Libav& av, std::int64_t ticks, AVRational time_base);

}  // namespace waymark::internal

#endif
