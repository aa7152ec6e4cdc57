#include <cstdio>
#include <string>
#include <vector>

#include "waymark/drivers/watchdog/watch_robot.hpp"

int main(int argc, char** argv) {
  const bool program = argc > 2 && argv[1] == waymark::kExec;
  if (argc != 2 && !program) {
    std::fputs(
        "usage: waymark-watchdog COMMAND\n"
        "       waymark-watchdog --exec PROGRAM [ARGUMENT ...]\n"
        "Holds the wire between `waymark` and the process of a robot, and stops the robot when `waymark` is\n"
        "gone, frozen or silent. Started by `waymark --robot process:COMMAND`; nobody needs to start it.\n",
        stderr);
    return 125;
  }
  if (program)
    return waymark::watch_robot(waymark::RobotCommand(std::vector<std::string>(argv + 2, argv + argc)));
  return waymark::watch_robot(waymark::RobotCommand(argv[1]));
}
