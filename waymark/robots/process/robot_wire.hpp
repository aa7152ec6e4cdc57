#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "waymark/base/fields.hpp"

namespace waymark {

/// Help text for the field `listen_only`.
inline constexpr std::string_view kListenOnlyHelp =
    "Listen only: send no command, since another program drives the robot";

/// Input and output of a robot process (docs/formats/robot-process.md).
struct RobotWire {
  int input = 0;                                       ///< descriptor from which orders are read
  std::function<bool(const std::string& line)> write;  ///< returns false if the reader has disconnected
  std::function<void(const std::string& text)> note;   ///< shows messages to the user before the hello
  std::function<bool()> should_stop = [] { return false; };
  bool listen_only = false;  ///< whether another program drives, so that nothing is sent to the robot
};

/// User settings for a robot process that joins a network.
struct RobotWireSettings {
  bool share_commands = false;  ///< drive even if another program commands the robot
  bool listen_only = false;     ///< RobotWire::listen_only

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.share_commands,
          JobField("share_commands",
                   "Drive although another program commands the robot, which then obeys both in turn"));
    visit(self.listen_only, JobField("listen_only", kListenOnlyHelp));
  }

  /// Whether to skip the check for other programs that command the robot.
  [[nodiscard]] bool shares() const { return share_commands || listen_only; }
};

/// The role of the program that writes to the input. Nothing is sent to the robot unless that program drives.
enum class InputRole : std::uint8_t {
  Unknown,  ///< nothing has been received yet
  Drives,   ///< declared by its hello, or implied by its first velocity
  Listens,  ///< declared by its hello ("listen_only") or by RobotWire::listen_only
};

}  // namespace waymark
