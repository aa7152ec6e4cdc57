#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace waymark {

/// Whether a file begins as a video file does (mp4, mov, mkv, webm, avi, MPEG transport or program stream).
/// 400 bytes are enough. Needs no library.
[[nodiscard]] bool begins_as_video(std::span<const std::uint8_t> head);
/// Whether a file of this name is written as a video: .mp4 .mov .m4v .mkv .webm .avi, any case.
[[nodiscard]] bool is_video_name(std::string_view path);
/// Whether a file of this name is read as a video even if it does not begin as one: those of is_video_name(),
/// whose reader reports what is wrong with them, and raw streams of a codec, which begin as many things do:
/// .h264 .264 .h265 .hevc .mjpeg .ivf, any case.
[[nodiscard]] bool has_video_ending(std::string_view path);

}  // namespace waymark
