#pragma once

#include <string>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark {

/// How a robot of that name is driven, one a line: the kinds of `--robot` and the profiles of ROS 2 that are
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
