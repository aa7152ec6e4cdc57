#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/robots/watchdog/watch_robot.hpp"

int main(int argc, char** argv) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  const auto take = [&words](std::string_view word) {
    const bool there = words.size() > 1 && words.front() == word;
    if (there) words.erase(words.begin());
    return there;
  };
  const bool listen_only = take(waymark::kListen);
  const bool program = take(waymark::kExec);
  const bool help = words.size() == 1 && (words.front() == "--help" || words.front() == "-h");
  if (help || words.empty() || (words.size() > 1 && !program)) {
    std::fputs(
        "usage: waymark-watchdog [--listen] COMMAND\n"
        "       waymark-watchdog [--listen] --exec PROGRAM [ARGUMENT ...]\n"
        "Holds the wire between `waymark` and the process of a robot, and stops the robot when `waymark` is\n"
        "gone, frozen or silent. With --listen somebody else drives the robot, and it is told no velocity.\n"
        "Started by `waymark --robot process:COMMAND`; nobody needs to start it.\n",
        help ? stdout : stderr);
    return help ? 0 : 125;
  }
  waymark::RobotCommand command =
      program ? waymark::RobotCommand(words) : waymark::RobotCommand(words.front());
  command.listen_only = listen_only;
  return waymark::watch_robot(command);
}
