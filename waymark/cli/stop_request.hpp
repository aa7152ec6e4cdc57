#pragma once

#include <memory>
#include <string>

#include "waymark/cli/console.hpp"
#include "waymark/drivers/watchdog/stop_socket.hpp"

namespace waymark::cli {

/// While it lives `waymark stop` ends this drive as Ctrl-C does. nullptr, and words, where that is not
/// possible: the drive goes on without.
[[nodiscard]] std::unique_ptr<StopSocket> hear_stop(const std::string& drive, Console& console);

}  // namespace waymark::cli
