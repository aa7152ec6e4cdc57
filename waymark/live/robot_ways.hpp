#pragma once

#include <string>
#include <vector>

namespace waymark {

/// How a robot of that name is driven, one a line: the kinds of `--robot` and the profiles of ROS 2 that are
/// made for it, with their addresses or topics; a word on any other way.
[[nodiscard]] std::vector<std::string> ways_to_reach(const std::string& robot);

}  // namespace waymark
