#pragma once

#include <optional>
#include <string>

#include "waymark/live/localize_camera.hpp"
#include "waymark/localization/method.hpp"

/// One line about where a robot or a camera is now (`waymark localize` of what is there), each with its end.
namespace waymark {

/// `since_s`: from the first line on.
[[nodiscard]] std::string estimate_line(double since_s, const std::optional<LocalizationEstimate>& estimate);
/// The keys of `--json` (docs/reference/cli.md).
[[nodiscard]] std::string estimate_json(SensorTime now, const std::optional<LocalizationEstimate>& estimate);

[[nodiscard]] std::string moment_line(double since_s, const CameraMoment& moment);
[[nodiscard]] std::string moment_json(const CameraMoment& moment);

}  // namespace waymark
