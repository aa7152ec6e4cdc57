#pragma once

#include <functional>
#include <string>

namespace waymark {

/// The ends of a robot process (docs/formats/robot-process.md), as its program sees them.
struct RobotWire {
  int input = 0;                                       ///< orders come by it
  std::function<bool(const std::string& line)> write;  ///< false: nobody reads any more
  std::function<void(const std::string& words)> say;   ///< for people, before the hello
  std::function<bool()> should_stop = [] { return false; };
  bool listen_only = false;  ///< somebody else drives: nothing is sent to the robot
};

}  // namespace waymark
