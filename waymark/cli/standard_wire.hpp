#pragma once

#include "waymark/cli/console.hpp"
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

/// The flag of a robot process that joins a network: others may command the robot as well.
void add_share_commands_flag(CLI::App& app, bool& shares);

}  // namespace waymark::cli
