#pragma once

#include <string>

#include "waymark/cli/console.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/drivers/process/robot_wire.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// Of a robot process that is this program: standard input and output; words go to the console, which must
/// outlive the wire.
[[nodiscard]] RobotWire standard_wire(Console& console, bool listen_only = false);

/// --listen-only of a robot's process: RobotWire::listen_only.
void add_listen_flag(CLI::App& app, bool& listen_only);

/// The flags of a robot process that joins a network: --robot-file, --share-commands and --listen-only.
struct NetworkRobotFlags {
  void add_to(CLI::App& app, const std::string& robot_file_help);
  /// Only the last two.
  void add_sharing(CLI::App& app);
  /// Nobody is asked whether others command the robot as well.
  [[nodiscard]] bool shares() const { return share_commands || listen_only; }
  /// The robot's file, or that of this name where none was given.
  [[nodiscard]] Result<RobotDescription> robot(const std::string& usual = {}) const;

  std::string robot_file{};
  bool share_commands = false;
  bool listen_only = false;
};

}  // namespace waymark::cli
