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
  /// Default: VP9 in .webm, motion JPEG in .avi, H.264 in others.
  std::optional<VideoCodec> codec{};
  int quality = 20;         ///< 0 (best) to 51, the rate factor of H.264; other codecs use an equivalent
  double rate_hz = 30;      ///< the nominal rate; the time step of .avi, which has no other stamps
  int key_interval = 60;    ///< [images] between two that are decoded independently
  double rotation_deg = 0;  ///< by which players rotate the images clockwise
};

/// Writes a video file. It is a temporary file in the same folder until close() renames it.
class VideoWriter {
 public:
  /// .mp4 .mov .m4v .mkv .webm .avi. Odd sides are padded by repeating the last column or row. Errors:
  /// InvalidArgument (size, name), Unsupported (no libav, no encoder for this codec), Unwritable.
  [[nodiscard]] static Result<VideoWriter> create(const std::filesystem::path& path, int width_px,
                                                  int height_px, const VideoWriterOptions& options = {});
  VideoWriter(VideoWriter&&) noexcept;
  VideoWriter& operator=(VideoWriter&&) noexcept;
  /// Without close() the file is removed.
  ~VideoWriter();

  /// Grey levels become luma unchanged (full range). Stamps must increase; they are stored in microseconds
  /// (.mkv and .webm: milliseconds). Errors: InvalidArgument (another size, a stamp that does not increase),
  /// Unwritable.
  [[nodiscard]] Status add(const ImageView& image, SensorTime stamp);
  [[nodiscard]] Status add(const ColorImage& image, SensorTime stamp);
  /// Finishes the file and moves it to its name.
  [[nodiscard]] Status close();

 private:
  struct Impl;
  explicit VideoWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark
