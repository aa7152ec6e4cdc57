#include "waymark/cli/standard_wire.hpp"

#include <cstdio>

#include <unistd.h>

#include "waymark/cli/flags.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/config/robot_list.hpp"

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

void NetworkRobotFlags::add_to(CLI::App& app, const std::string& robot_file_help) {
  add_option(app, "--robot-file NAME", robot_file, robot_file_help);
  add_sharing(app);
}

void NetworkRobotFlags::add_sharing(CLI::App& app) {
  app.add_flag("--share-commands", share_commands,
               "Drive although another program commands the robot, which then obeys both in turn");
  add_listen_flag(app, listen_only);
}

Result<RobotDescription> NetworkRobotFlags::robot(const std::string& usual) const {
  return read_named_robot(robot_file.empty() ? usual : robot_file);
}

}  // namespace waymark::cli
