#include "waymark/cli/standard_wire.hpp"

#include <cstdio>

#include <unistd.h>
#include <CLI/App.hpp>

#include "waymark/cli/interrupt.hpp"

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

void add_listen_flag(CLI::App& app, bool& listen_only) {
  app.add_flag("--listen-only", listen_only, "Send the robot nothing: somebody else drives it");
}

void add_share_commands_flag(CLI::App& app, bool& shares) {
  app.add_flag("--share-commands", shares,
               "Drive although another program commands the robot, which then obeys both in turn");
}

}  // namespace waymark::cli
