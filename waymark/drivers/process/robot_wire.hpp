#pragma once

#include <cstdint>
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

/// What the program at the other end of the input is there for. Nothing is sent to the robot before it
/// drives.
enum class InputRole : std::uint8_t {
  Unknown,  ///< it has said nothing yet
  Drives,   ///< by its hello, or by its first velocity
  Listens,  ///< by its hello ("listen_only"), or by RobotWire::listen_only
};

}  // namespace waymark
