#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "waymark/base/fields.hpp"

namespace waymark {

/// Help of the field `listen_only`.
inline constexpr std::string_view kListenOnlyHelp =
    "Listen only: send no command, since another program drives the robot";

/// Input and output of a robot process (docs/formats/robot-process.md).
struct RobotWire {
  int input = 0;                                       ///< descriptor of the orders
  std::function<bool(const std::string& line)> write;  ///< returns false if the reader has gone
  std::function<void(const std::string& text)> note;   ///< shows messages to the user before the hello
  std::function<bool()> should_stop = [] { return false; };
  bool listen_only = false;  ///< another program drives: nothing is sent to the robot
};

/// User settings of a robot process that joins a network.
struct RobotWireSettings {
  bool share_commands = false;  ///< drive although another program commands the robot
  bool listen_only = false;     ///< RobotWire::listen_only

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.share_commands,
          JobField("share_commands",
                   "Drive although another program commands the robot, which then obeys both in turn"));
    visit(self.listen_only, JobField("listen_only", kListenOnlyHelp));
  }

  /// Whether the check for other programs that command the robot is skipped.
  [[nodiscard]] bool shares() const { return share_commands || listen_only; }
};

/// The role of the program that writes to the input. Nothing is sent to the robot unless it drives.
enum class InputRole : std::uint8_t {
  Unknown,  ///< nothing received yet
  Drives,   ///< by its hello, or by its first velocity
  Listens,  ///< by its hello ("listen_only"), or by RobotWire::listen_only
};

}  // namespace waymark
