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
  [[nodiscard]] const std::vector<VideoProblem>& all() const { return all_; }
  [[nodiscard]] const std::string& source() const { return source_; }

 private:
  std::string source_;
  std::vector<VideoProblem> all_{};
};

/// "12.345 s".
[[nodiscard]] std::string in_seconds(Duration since_start);

}  // namespace waymark::internal
