#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace waymark {

/// Whether a file begins like a video file (mp4, mov, mkv, webm, avi, MPEG transport or program stream). The
/// first 400 bytes are enough. Needs no library.
[[nodiscard]] bool begins_as_video(std::span<const std::uint8_t> head);
/// Whether a file with this name is written as a video: .mp4 .mov .m4v .mkv .webm .avi (case-insensitive).
[[nodiscard]] bool is_video_name(std::string_view path);
/// Whether a file with this name is read as a video even if it does not begin like one. This holds for names
/// that is_video_name() accepts, so that the video reader reports the problem. It also holds for raw codec
/// streams, whose first bytes are not distinctive: .h264 .264 .h265 .hevc .mjpeg .ivf (case-insensitive).
[[nodiscard]] bool has_video_ending(std::string_view path);

}  // namespace waymark
