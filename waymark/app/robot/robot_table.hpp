#pragma once

#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/config/yaml/robot_file.hpp"

namespace waymark {

/// A robot for people, some lines: what it is and where the facts are from (`comment` of its file), body,
/// limits, wheels, each camera with its mounting, and how it behaves in simulation.
[[nodiscard]] std::string robot_text(const RobotDescription& robot, const std::string& comment);

/// How a robot of that name is driven, one a line: the kinds of `robot` and the profiles of ROS 2 that are
/// made for it, with their addresses or topics; a word on any other way.
[[nodiscard]] std::vector<std::string> ways_to_reach(const std::string& robot);

/// The robots that come with this program, one a line, and the files that cannot be read.
struct RobotTable {
  std::string text{};
  std::vector<Error> errors{};
};
[[nodiscard]] Result<RobotTable> robot_table();
/// A robot, by name or path of its file, and how it is driven.
[[nodiscard]] Result<std::string> explained_robot(const std::string& name);

}  // namespace waymark
