#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "waymark/base/fields.hpp"

namespace waymark {

/// Of the field `listen_only` of a robot process.
inline constexpr std::string_view kListenOnlyHelp = "Send the robot nothing: somebody else drives it";

/// The ends of a robot process (docs/formats/robot-process.md), as its program sees them.
struct RobotWire {
  int input = 0;                                       ///< orders come by it
  std::function<bool(const std::string& line)> write;  ///< false: nobody reads any more
  std::function<void(const std::string& words)> say;   ///< for people, before the hello
  std::function<bool()> should_stop = [] { return false; };
  bool listen_only = false;  ///< somebody else drives: nothing is sent to the robot
};

/// What a user says of a robot process that joins a network.
struct RobotWireWords {
  bool share_commands = false;  ///< drive although another program commands the robot
  bool listen_only = false;     ///< RobotWire::listen_only

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.share_commands,
          JobField("share_commands",
                   "Drive although another program commands the robot, which then obeys both in turn"));
    visit(self.listen_only, JobField("listen_only", kListenOnlyHelp));
  }

  /// Nobody is asked whether others command the robot as well.
  [[nodiscard]] bool shares() const { return share_commands || listen_only; }
};

/// What the program at the other end of the input is there for. Nothing is sent to the robot before it
/// drives.
enum class InputRole : std::uint8_t {
  Unknown,  ///< it has said nothing yet
  Drives,   ///< by its hello, or by its first velocity
  Listens,  ///< by its hello ("listen_only"), or by RobotWire::listen_only
};

}  // namespace waymark
