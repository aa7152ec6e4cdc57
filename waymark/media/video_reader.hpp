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
  std::int64_t max_pixels = 100'000'000;  ///< per image; exceeding this is a LimitExceeded error
  int threads = 0;                        ///< decoder threads; 0 means one per core
  double gap_s = 1.0;                     ///< a longer time without images is reported

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.max_pixels,
          Field{"max_pixels", "Largest accepted number of pixels of an image.", 1, 2147483647});
    visit(self.threads, Field{"threads", "Number of decoder threads; 0 means one per core.", 0, 64});
    visit(self.gap_s,
          Field{"gap_s", "Shortest time without images that is reported as a gap [s].", 0.01, 1e6});
  }
};

/// Properties of a video file, available before any image is decoded.
struct VideoInfo {
  std::string container{};  ///< libavformat's name: "mov,mp4,m4a,3gp,3g2,mj2", "matroska,webm"
  std::string codec{};      ///< "h264", "hevc", "vp9", "av1", "mjpeg", …
  int width_px = 0;         ///< as stored, before any rotation
  int height_px = 0;
  /// Degrees by which a player rotates the images clockwise for display (90 for a phone held upright). Images
  /// are returned as stored.
  double rotation_deg = 0;
  std::optional<double> mean_rate_hz{};
  std::optional<Duration> duration{};
  std::optional<std::int64_t> frames{};  ///< if the file states it
};

/// One image. The view is valid until the next call to VideoReader::next().
struct VideoFrame {
  ImageView luma{};        ///< as stored: full range or 16 to 235
  SensorTime stamp{};      ///< presentation time since the first image
  std::int64_t index = 0;  ///< index among the returned images
  bool is_key = false;     ///< decoded independently of other images
};

/// A problem with a video that should be shown to users.
struct VideoProblem {
  std::string
      key{};  ///< stable key: video.damaged, video.no_whole_image (to the end), video.truncated, video.gap,
              ///< video.no_stamps, video.order, video.interlaced, video.size_changes, video.rotated
  Error error{};            ///< message, with the place of the first occurrence
  std::uint64_t count = 1;  ///< number of occurrences
};

/// Reads a video file from its beginning to its end.
class VideoReader {
 public:
  /// Errors: NotFound, Unreadable (not a video, missing index, only sound), Unsupported (a pipe or a device,
  /// a codec that is not installed, no libav), LimitExceeded.
  [[nodiscard]] static Result<VideoReader> open(const std::filesystem::path& path,
                                                const VideoReaderOptions& options = {});
  /// The same for bytes in memory, which must outlive the reader; `name` is their name in errors.
  [[nodiscard]] static Result<VideoReader> open(std::span<const std::uint8_t> bytes, const std::string& name,
                                                const VideoReaderOptions& options = {});
  VideoReader(VideoReader&&) noexcept;
  VideoReader& operator=(VideoReader&&) noexcept;
  ~VideoReader();

  [[nodiscard]] const VideoInfo& info() const;
  /// The next image; empty at the end. Stamps always increase. Damaged data are skipped and added to the
  /// problems. Fails only if reading cannot continue (LimitExceeded).
  [[nodiscard]] Result<std::optional<VideoFrame>> next();
  /// Problems found so far; complete once next() has returned an empty value.
  [[nodiscard]] const std::vector<VideoProblem>& problems() const;
  /// Fraction of the file read so far, 0 to 1.
  [[nodiscard]] double progress() const;

 private:
  struct Impl;
  explicit VideoReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark
