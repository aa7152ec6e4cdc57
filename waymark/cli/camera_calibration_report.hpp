#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/mapping/camera_calibration.hpp"

namespace waymark::cli {

/// Numbers with their standard deviations, lenses tried, pictures, parts of the image, advice.
[[nodiscard]] std::string to_text(const CameraCalibration& found, const std::vector<std::string>& pictures);

/// The contract of `waymark calibrate camera --json` (docs/reference/cli.md).
[[nodiscard]] nlohmann::ordered_json to_json(const CameraCalibration& found,
                                             const std::vector<std::string>& pictures);

}  // namespace waymark::cli
