#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace waymark {

/// Whether a file begins as a video file does (mp4, mov, mkv, webm, avi, MPEG transport or program stream).
/// Raw codec streams have ambiguous first bytes, so they are recognised by their names: .h264 .264 .h265
/// .hevc .mjpeg .ivf. Needs no library. False if there is no such regular file.
[[nodiscard]] bool looks_like_video(const std::string& path);
/// The same for the first bytes of a file; 400 are enough.
[[nodiscard]] bool begins_as_video(std::span<const std::uint8_t> head);
/// Whether a file of this name is written as a video: .mp4 .mov .m4v .mkv .webm .avi, any case.
[[nodiscard]] bool is_video_name(std::string_view path);

}  // namespace waymark
