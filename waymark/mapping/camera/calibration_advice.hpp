#pragma once

#include <string>
#include <vector>

#include "waymark/mapping/camera/camera_calibration.hpp"

namespace waymark::internal {

/// What more to photograph: empty parts of the image, too few tilts, too few pictures, a region that fits
/// worse than the others, numbers that stay uncertain. Sentences for people.
[[nodiscard]] std::vector<std::string> calibration_advice(const CameraCalibration& found);

}  // namespace waymark::internal
