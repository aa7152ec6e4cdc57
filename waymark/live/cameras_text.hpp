#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/drivers/v4l2/device_list.hpp"

namespace waymark {

/// The cameras of this computer as a table for people; ends with an end of line. With `controls` all of them,
/// with their ranges.
[[nodiscard]] std::string to_text(const std::vector<CameraDevice>& devices, bool controls);
/// The keys of `waymark cameras --json` (docs/reference/cli.md).
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<CameraDevice>& devices);
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<CameraControl>& controls);

}  // namespace waymark
