#pragma once

#include <string>

#include "waymark/app/calibrate_camera/calibrate_camera.hpp"

namespace waymark {

/// Numbers with their standard deviations, lenses tried, pictures, parts of the image, advice.
[[nodiscard]] std::string to_text(const CalibrateCameraReport& report);

}  // namespace waymark
