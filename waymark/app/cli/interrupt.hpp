#pragma once

namespace waymark::cli {

/// From now on the first Ctrl-C (or SIGTERM) only raises a flag, so that the picture at hand is finished and
/// what was done is kept; the second of the same kind says so and ends the
/// program at once. Writing to a closed pipe, or more than a
/// file may hold, becomes an error instead of a signal.
void watch_signals();

/// The same as Ctrl-C, from any thread: another process asked for it with `waymark stop`.
void interrupt();

/// Whether Ctrl-C was pressed, or a stop was requested, since watch_signals().
[[nodiscard]] bool interrupted();
/// Which of the two, in words: "Ctrl-C" or "'waymark stop'".
[[nodiscard]] const char* interrupted_by();

}  // namespace waymark::cli
