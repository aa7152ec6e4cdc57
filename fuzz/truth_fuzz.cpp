// Any text is either a ground truth of existing tags with finite corners, or an Error with a place; nothing
// crashes.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "waymark/evaluation/detections.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto truth = waymark::parse_truth({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!truth) {
    if (truth.error().message.empty() || truth.error().place.source != "fuzz") std::abort();
    return 0;
  }
  for (const auto& [image, tags] : *truth) {
    if (waymark::find_image(*truth, image) != image) std::abort();
    for (const auto& tag : tags) {
      const auto known = static_cast<int>(waymark::family(tag.tag.family).codes.size());
      if (tag.tag.number < 0 || tag.tag.number >= known || !std::isfinite(tag.size_px)) std::abort();
      for (const auto& corner : tag.corners_px) {
        if (!corner.allFinite()) std::abort();
      }
    }
  }
  return 0;
}
