#pragma once

#include "waymark/cli/console.hpp"
#include "waymark/jobs/job_control.hpp"

namespace waymark::cli {

/// A job's progress and notes go to the console, and Ctrl-C cancels it.
[[nodiscard]] JobControl control_from(Console& console);

/// Nothing is shown; Ctrl-C cancels.
[[nodiscard]] JobControl silent_control();

}  // namespace waymark::cli
