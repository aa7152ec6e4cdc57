#include "waymark/media/video_problems.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace waymark::internal {

void VideoProblems::add(const std::string& key, ErrorCode code, const std::string& message,
                        std::optional<std::int64_t> byte, const std::string& hint) {
  const auto known = std::ranges::find(all_, key, &VideoProblem::key);
  if (known != all_.end()) {
    ++known->count;
    return;
  }
  all_.push_back({key, Error{code, message, {.source = source_, .byte = byte}, hint}, 1});
}

void VideoProblems::add_end(const VideoInfo& info, Duration last_picture, Duration last_packet,
                            std::int64_t size_bytes) {
  constexpr double kTolerance_s = 0.5;  // sound may last longer than the pictures
  const double rate_hz = info.mean_rate_hz.value_or(25);
  double expected_s = info.duration ? to_seconds(*info.duration) : 0;
  if (info.frames) expected_s = std::max(expected_s, static_cast<double>(*info.frames) / rate_hz);
  const double missing_s = std::max(kTolerance_s, 2 / rate_hz);
  if (expected_s - to_seconds(last_picture) <= missing_s) return;
  if (expected_s - to_seconds(std::max(last_picture, last_packet)) > missing_s)
    add("video.truncated", ErrorCode::Unreadable,
        fmt::format("the pictures end at {:.3f} s of {:.3f} s", to_seconds(last_picture), expected_s),
        size_bytes, "The file was cut short, or its end is damaged: copy it again.");
  else
    add("video.no_whole_picture", ErrorCode::Unreadable,
        fmt::format("no picture between {:.3f} s and the end at {:.3f} s is whole", to_seconds(last_picture),
                    expected_s),
        {},
        "They are predicted from what is damaged. Copy the file again; a video with more key frames loses "
        "less.");
}

void VideoProblems::add_rotation(const VideoInfo& info) {
  if (info.rotation_deg == 0) return;
  add("video.rotated", ErrorCode::Unsupported,
      fmt::format(
          "has a rotation flag: players turn its pictures {:g} degrees clockwise; here pixels are taken "
          "as they are stored",
          info.rotation_deg),
      {}, "Calibrate the camera with pictures that are stored the same way.");
}

std::string in_seconds(Duration since_start) { return fmt::format("{:.3f} s", to_seconds(since_start)); }

}  // namespace waymark::internal
