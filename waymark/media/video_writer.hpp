#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/image/image.hpp"

namespace waymark {

enum class VideoCodec : std::uint8_t { H264, Hevc, Vp9, Av1, Mjpeg };

struct VideoWriterOptions {
  /// Unless given: VP9 in .webm, motion JPEG in .avi, H.264 in others.
  std::optional<VideoCodec> codec{};
  int quality = 20;         ///< 0 (best) to 51, as the rate factor of H.264; of other codecs what corresponds
  double rate_hz = 30;      ///< the nominal rate; the time step of .avi, which knows no other stamps
  int key_interval = 60;    ///< [pictures] between two that are decoded alone
  double rotation_deg = 0;  ///< by which players turn the pictures clockwise
};

/// A video file that is being written. It appears under its name when it is closed; until then it lies beside
/// it.
class VideoWriter {
 public:
  /// .mp4 .mov .m4v .mkv .webm .avi. Sides that are odd are completed by repeating the last column or row.
  /// Errors: InvalidArgument (size, name), Unsupported (no libav, no encoder for this codec), Unwritable.
  [[nodiscard]] static Result<VideoWriter> create(const std::filesystem::path& path, int width_px,
                                                  int height_px, const VideoWriterOptions& options = {});
  VideoWriter(VideoWriter&&) noexcept;
  VideoWriter& operator=(VideoWriter&&) noexcept;
  /// Without close() nothing is left of the file.
  ~VideoWriter();

  /// Grey levels become luma as they are (full range). Stamps grow; the file keeps microseconds (.mkv and
  /// .webm: milliseconds). Errors: InvalidArgument (another size, a stamp that does not grow), Unwritable.
  [[nodiscard]] Status add(const ImageView& image, SensorTime stamp);
  [[nodiscard]] Status add(const ColorImage& image, SensorTime stamp);
  /// Ends the file and puts it in its place.
  [[nodiscard]] Status close();

 private:
  struct Impl;
  explicit VideoWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark
