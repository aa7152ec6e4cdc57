#pragma once

#include <span>
#include <string>

#include "waymark/app/common/detect_all.hpp"
#include "waymark/app/common/poses.hpp"
#include "waymark/evaluation/detections.hpp"

namespace waymark {

/// What was seen in one picture, as a table for people; ends with an end of line. Requires report.detected.
[[nodiscard]] std::string to_text(const PictureReport& report);

/// The scores as tables for people: recall by size and tilt, corner error and bias by size and by tilt, the
/// sums.
[[nodiscard]] std::string to_text(const DetectionScores& scores);

/// The poses of one picture's tags: position and distance with standard deviations, both solutions; ends with
/// an end of line. Empty when there are none.
[[nodiscard]] std::string to_text(std::span<const TagDetection> detections, const PoseList& poses);

}  // namespace waymark
