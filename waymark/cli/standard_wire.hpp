#pragma once

#include "waymark/cli/console.hpp"
#include "waymark/drivers/process/robot_wire.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// Of a robot process that is this program: standard input and output; words go to the console, which must
/// outlive the wire.
[[nodiscard]] RobotWire standard_wire(Console& console);

/// The flag of a robot process that joins a network: others may command the robot as well.
void add_share_commands_flag(CLI::App& app, bool& shares);

}  // namespace waymark::cli
