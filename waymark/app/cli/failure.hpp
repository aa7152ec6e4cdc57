#pragma once

#include "waymark/app/cli/console.hpp"

/// How a verb fails: which words, and which exit code.
namespace waymark::cli {

/// The error with the flag that sets its key, as people type it: "(--tag-size-m): …". One with a place in a
/// file stays as it is.
[[nodiscard]] Error naming_flag(Error error);

/// 2 for what the command line or the environment says (the error's key is a flag, its source is
/// "environment"), 1 for a file that is not usable or could not be written. Console::finish() makes 130 of
/// both after Ctrl-C.
[[nodiscard]] ExitCode exit_code_of(const Error& error);

/// Says the error with its flag, and gives back its exit code.
[[nodiscard]] ExitCode fail_with(const Error& error, Console& console);

/// Says the error with its flag: of what makes no sense (InvalidArgument) 2, else as fail_with().
[[nodiscard]] ExitCode fail_by_kind(const Error& error, Console& console);

/// Says the error with its flag: the command line makes no sense.
[[nodiscard]] ExitCode fail_usage(const Error& error, Console& console);

}  // namespace waymark::cli
