#pragma once

#include <string>
#include <vector>

#include "waymark/media/video_reader.hpp"

namespace waymark::internal {

/// Problems of one video, one entry a kind.
class VideoProblems {
 public:
  explicit VideoProblems(std::string source) : source_(std::move(source)) {}

  /// Counts it; the first of a kind keeps its words and place.
  void add(const std::string& key, ErrorCode code, const std::string& message,
           std::optional<std::int64_t> byte = {}, const std::string& hint = {});
  /// At the end of a file of `size_bytes`: that its pictures, or its packets, end before the time it says.
  void add_end(const VideoInfo& info, Duration last_picture, Duration last_packet, std::int64_t size_bytes);
  /// That players turn the pictures.
  void add_rotation(const VideoInfo& info);
  [[nodiscard]] const std::vector<VideoProblem>& all() const { return all_; }
  [[nodiscard]] const std::string& source() const { return source_; }

 private:
  std::string source_;
  std::vector<VideoProblem> all_{};
};

/// "12.345 s".
[[nodiscard]] std::string in_seconds(Duration since_start);

}  // namespace waymark::internal
