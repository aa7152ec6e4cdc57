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

std::string in_seconds(Duration since_start) { return fmt::format("{:.3f} s", to_seconds(since_start)); }

}  // namespace waymark::internal
