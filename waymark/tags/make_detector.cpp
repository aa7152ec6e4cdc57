#include "waymark/tags/make_detector.hpp"

#include <fmt/format.h>

#include "waymark/tags/apriltag3/apriltag_detector.hpp"
#include "waymark/tags/detector/waymark_detector.hpp"

namespace waymark {

Result<std::unique_ptr<Detector>> make_detector(const DetectorOptions& options) {
  if (options.detector == "apriltag3") return make_apriltag_detector(options);
  if (options.detector == "waymark") return make_waymark_detector(options);
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown detector '{}'", options.detector),
              {.key = "detector"}, "Use waymark or apriltag3.");
}

}  // namespace waymark
