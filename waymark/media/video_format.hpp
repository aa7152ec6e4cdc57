#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace waymark {

/// Whether a file begins as a video file does (mp4, mov, mkv, webm, avi, MPEG transport or program stream),
/// or, for raw streams of a codec, which begin as many things do, is called .h264 .264 .h265 .hevc .mjpeg
/// .ivf. Needs no library. False where there is no such regular file.
[[nodiscard]] bool looks_like_video(const std::string& path);
/// The same of the first bytes; enough are 400.
[[nodiscard]] bool begins_as_video(std::span<const std::uint8_t> head);
/// Whether a file of this name is written as a video: .mp4 .mov .m4v .mkv .webm .avi, any case.
[[nodiscard]] bool is_video_name(std::string_view path);

}  // namespace waymark
