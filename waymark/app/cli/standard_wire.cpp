#include "waymark/app/cli/standard_wire.hpp"

#include <cstdio>
#include <string>

#include <unistd.h>

#include "waymark/app/cli/interrupt.hpp"

namespace waymark::cli {

RobotWire standard_wire(Console& console, bool listen_only) {
  return {.input = STDIN_FILENO,
          .write =
              [](const std::string& line) {
                return std::fwrite(line.data(), 1, line.size(), stdout) == line.size() &&
                       std::fflush(stdout) == 0;
              },
          .say = [&console](const std::string& words) { console.say(words); },
          .should_stop = interrupted,
          .listen_only = listen_only};
}

}  // namespace waymark::cli
