#pragma once

#include <memory>
#include <string>

#include "waymark/app/cli/console.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/robots/watchdog/stop_socket.hpp"

namespace waymark::cli {

/// A job's progress and notes go to the console, and Ctrl-C cancels it.
[[nodiscard]] JobControl control_from(Console& console);

/// While it lives `waymark stop` ends this drive as Ctrl-C does. nullptr, and words, where that is not
/// possible: the drive goes on without.
[[nodiscard]] std::unique_ptr<StopSocket> listen_for_stop(const std::string& drive, Console& console);

}  // namespace waymark::cli
