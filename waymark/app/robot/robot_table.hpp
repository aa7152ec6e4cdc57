#pragma once

#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/config/yaml/robot_file.hpp"

namespace waymark {

/// A robot as text: its description with sources (`comment` of its file), body, limits, wheels, each camera
/// with its mounting, and its behaviour in simulation.
[[nodiscard]] std::string robot_text(const RobotDescription& robot, const std::string& comment);

/// Ways to connect to a robot of that name, one line each: kinds of `robot` and ROS 2 profiles for it, with
/// their addresses or topics; last, a robot process.
[[nodiscard]] std::vector<std::string> ways_to_reach(const std::string& robot);

/// The robots that come with this program, one per line, and the errors of unreadable files.
struct RobotTable {
  std::string text{};
  std::vector<Error> errors{};
};
[[nodiscard]] Result<RobotTable> robot_table();
/// A robot, by name or path of its file, and how to connect to it.
[[nodiscard]] Result<std::string> explained_robot(const std::string& name);

}  // namespace waymark
