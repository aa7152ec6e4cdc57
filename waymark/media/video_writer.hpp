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
  /// By default, VP9 in .webm, Motion JPEG in .avi and H.264 in all others.
  std::optional<VideoCodec> codec{};
  int quality = 20;         ///< 0 (best) to 51, the H.264 rate factor; other codecs use an equivalent
  double rate_hz = 30;      ///< nominal rate; also the time step in .avi files, which have no other stamps
  int key_interval = 60;    ///< number of images between two that are decoded independently
  double rotation_deg = 0;  ///< clockwise rotation that players apply to the images
};

/// Writes a video file. It is a temporary file in the same folder until close() renames it.
class VideoWriter {
 public:
  /// Opens a .mp4, .mov, .m4v, .mkv, .webm or .avi file. Odd sides are padded by repeating the last column or
  /// row. Errors: InvalidArgument (size, name), Unsupported (no libav, no encoder for this codec),
  /// Unwritable.
  [[nodiscard]] static Result<VideoWriter> create(const std::filesystem::path& path, int width_px,
                                                  int height_px, const VideoWriterOptions& options = {});
  VideoWriter(VideoWriter&&) noexcept;
  VideoWriter& operator=(VideoWriter&&) noexcept;
  /// Removes the file unless close() has been called.
  ~VideoWriter();

  /// Grey levels become luma unchanged (full range). Stamps must increase; they are stored in microseconds
  /// (.mkv and .webm: milliseconds). Errors: InvalidArgument (a different size, a stamp that does not
  /// increase), Unwritable.
  [[nodiscard]] Status add(const ImageView& image, SensorTime stamp);
  [[nodiscard]] Status add(const ColorImage& image, SensorTime stamp);
  /// Finishes the file and renames it to its final name.
  [[nodiscard]] Status close();

 private:
  struct Impl;
  explicit VideoWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark
