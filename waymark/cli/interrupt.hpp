#pragma once

namespace waymark::cli {

/// From now on the first Ctrl-C (or SIGTERM) only raises a flag, so that the picture at hand is finished and
/// what was done is kept; the second one ends the program at once. Writing to a closed pipe, or more than a
/// file may hold, becomes an error instead of a signal.
void watch_signals();

/// The same as Ctrl-C, from any thread.
void interrupt();

/// Whether Ctrl-C was pressed since watch_signals().
[[nodiscard]] bool interrupted();

}  // namespace waymark::cli
