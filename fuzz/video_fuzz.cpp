// Any bytes are either a video whose images have pixels and increasing stamps, or an Error; nothing crashes,
// leaks or prints.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>

#include "waymark/media/video_reader.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  auto reader =
      waymark::VideoReader::open(std::span(data, size), "fuzz", {.max_pixels = 100'000, .threads = 1});
  if (!reader) {
    if (reader.error().message.empty() || reader.error().place.source != "fuzz") std::abort();
    return 0;
  }
  std::optional<waymark::SensorTime> last;
  constexpr int kMaxImages = 50;
  for (int k = 0; k < kMaxImages; ++k) {
    const auto frame = reader->next();
    if (!frame || !*frame) break;
    if ((*frame)->luma.empty() || (last && (*frame)->stamp <= *last)) std::abort();
    last = (*frame)->stamp;
  }
  for (const waymark::VideoProblem& problem : reader->problems())
    if (problem.error.message.empty() || problem.count == 0) std::abort();
  return 0;
}
