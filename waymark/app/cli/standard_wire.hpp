#pragma once

#include "waymark/app/cli/console.hpp"
#include "waymark/robots/process/robot_wire.hpp"

namespace waymark::cli {

/// Of a robot process that is this program: standard input and output; words go to the console, which must
/// outlive the wire.
[[nodiscard]] RobotWire standard_wire(Console& console, bool listen_only = false);

}  // namespace waymark::cli
