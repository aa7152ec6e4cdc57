#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
#include "waymark/image/image.hpp"

namespace waymark {

struct VideoReaderOptions {
  std::int64_t max_pixels = 100'000'000;  ///< of a picture; more is a LimitExceeded error
  int threads = 0;                        ///< that decode; 0: one a core
  double gap_s = 1.0;                     ///< a longer time without pictures is reported

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.max_pixels,
          Field{"max_pixels", "Largest accepted number of pixels of a picture.", 1, 2147483647});
    visit(self.threads, Field{"threads", "Number of threads that decode; 0 means one a core.", 0, 64});
    visit(self.gap_s, Field{"gap_s", "Time without pictures that is reported as a gap [s].", 0.01, 1e6});
  }
};

/// What a file says of its pictures before any is decoded.
struct VideoInfo {
  std::string container{};  ///< "mov,mp4,m4a,3gp,3g2,mj2", "matroska,webm", as libavformat calls it
  std::string codec{};      ///< "h264", "hevc", "vp9", "av1", "mjpeg", …
  int width_px = 0;         ///< as stored, before any rotation
  int height_px = 0;
  /// By how many degrees a player turns the pictures clockwise before it shows them (a phone held upright:
  /// 90). They are delivered as stored.
  double rotation_deg = 0;
  std::optional<double> mean_rate_hz{};
  std::optional<Duration> duration{};
  std::optional<std::int64_t> frames{};  ///< where the file says it
};

/// One picture. The view is valid until the next call of VideoReader::next().
struct VideoFrame {
  ImageView luma{};        ///< as stored: full range or 16 to 235
  SensorTime stamp{};      ///< presentation time since the first picture
  std::int64_t index = 0;  ///< of the pictures that were delivered
  bool is_key = false;     ///< decoded without any other
};

/// Something about a video that a user must know.
struct VideoProblem {
  std::string key{};        ///< a stable word: video.damaged, video.no_whole_picture (to the end),
                            ///< video.truncated, video.gap, video.no_stamps, video.order, video.interlaced,
                            ///< video.size_changes, video.rotated
  Error error{};            ///< in words, with the place of the first one
  std::uint64_t count = 1;  ///< how often
};

/// A video file, open for reading from its beginning to its end.
class VideoReader {
 public:
  /// Errors: NotFound, Unreadable (no video, index missing, only sound), Unsupported (a pipe or a device, a
  /// codec that is not installed, no libav), LimitExceeded.
  [[nodiscard]] static Result<VideoReader> open(const std::filesystem::path& path,
                                                const VideoReaderOptions& options = {});
  /// The same of bytes in memory, which must stay there; `name` is what errors call them.
  [[nodiscard]] static Result<VideoReader> open(std::span<const std::uint8_t> bytes, const std::string& name,
                                                const VideoReaderOptions& options = {});
  VideoReader(VideoReader&&) noexcept;
  VideoReader& operator=(VideoReader&&) noexcept;
  ~VideoReader();

  [[nodiscard]] const VideoInfo& info() const;
  /// The next picture; nothing at the end. Stamps grow. Damage is passed over and noted among the problems.
  /// An error only where reading cannot go on (LimitExceeded).
  [[nodiscard]] Result<std::optional<VideoFrame>> next();
  /// What was noticed so far; complete once next() has given nothing.
  [[nodiscard]] const std::vector<VideoProblem>& problems() const;
  /// How much of the file was read, 0 to 1.
  [[nodiscard]] double progress() const;

 private:
  struct Impl;
  explicit VideoReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark
