#pragma once

#include <string>

#include "waymark/app/calibrate_robot/calibrate_robot.hpp"

namespace waymark {

/// A line a number: its value and standard deviation, or what to drive to tell it.
[[nodiscard]] std::string to_text(const CalibrateRobotReport& report);

}  // namespace waymark
