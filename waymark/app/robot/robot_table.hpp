#pragma once

#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/config/yaml/robot_file.hpp"

namespace waymark {

/// Formats a robot as text: its description with sources (`comment` in its file), body, limits, wheels, each
/// camera with its mounting, and its behaviour in simulation.
[[nodiscard]] std::string robot_text(const RobotDescription& robot, const std::string& comment);

/// How to connect to a robot with this name. There is one line for each kind of `robot` and each ROS 2
/// profile that suits it, with its address or topics, and finally one for a robot process.
[[nodiscard]] std::vector<std::string> ways_to_reach(const std::string& robot);

/// The robots included with this program, one per line, and the errors for unreadable files.
struct RobotTable {
  std::string text{};
  std::vector<Error> errors{};
};
[[nodiscard]] Result<RobotTable> robot_table();
/// Describes a robot, specified by its name or the path of its file, and how to connect to it.
[[nodiscard]] Result<std::string> explained_robot(const std::string& name);

}  // namespace waymark
