#include "waymark/cli/standard_wire.hpp"

#include <cstdio>

#include <unistd.h>

#include "waymark/cli/interrupt.hpp"

namespace waymark::cli {

RobotWire standard_wire(Console& console) {
  return {.input = STDIN_FILENO,
          .write =
              [](const std::string& line) {
                return std::fwrite(line.data(), 1, line.size(), stdout) == line.size() &&
                       std::fflush(stdout) == 0;
              },
          .say = [&console](const std::string& words) { console.say(words); },
          .should_stop = interrupted};
}

}  // namespace waymark::cli
