#pragma once

#include <string>

#include "waymark/cli/detections_json.hpp"
#include "waymark/evaluation/detections.hpp"

namespace waymark::cli {

/// What was seen in one picture, as a table for people; ends with an end of line. Requires report.detected.
[[nodiscard]] std::string to_text(const PictureReport& report);

/// The scores as tables for people: recall by size and tilt, corner error and bias by size and by tilt, the
/// sums.
[[nodiscard]] std::string to_text(const DetectionScores& scores);

/// The scores as one object; its keys are the contract of `waymark evaluate detections --json`.
[[nodiscard]] nlohmann::ordered_json to_json(const DetectionScores& scores);

}  // namespace waymark::cli
