#pragma once

#include "waymark/cli/interrupt.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark::cli {

/// How every verb opens a recording: Ctrl-C ends the unpacking of a packed one.
[[nodiscard]] inline LogOptions until_interrupted(LogOptions options = {}) {
  options.unpack.stop = interrupted;
  return options;
}

}  // namespace waymark::cli
