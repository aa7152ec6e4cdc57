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
        "Connects `waymark` with the process of a robot, and stops the robot if `waymark` has exited, is\n"
        "frozen or silent. With --listen another program drives the robot, and no velocity is sent.\n"
        "`waymark --robot process:COMMAND` starts it; do not start it yourself.\n",
        help ? stdout : stderr);
    return help ? 0 : 125;
  }
  waymark::RobotCommand command =
      program ? waymark::RobotCommand(words) : waymark::RobotCommand(words.front());
  command.listen_only = listen_only;
  return waymark::watch_robot(command);
}
