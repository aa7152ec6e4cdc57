#pragma once

#include <string>

#include "waymark/base/error.hpp"
#include "waymark/config/robot_file.hpp"

namespace waymark {

/// A robot for people, some lines: what it is and where the facts are from (`comment` of its file), body,
/// limits, wheels, each camera with its mounting, and how it behaves in simulation.
[[nodiscard]] std::string robot_text(const RobotDescription& robot, const std::string& comment);

}  // namespace waymark
