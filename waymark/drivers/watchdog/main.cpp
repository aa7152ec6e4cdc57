#include <cstdio>
#include <string>

#include "waymark/drivers/watchdog/watch_robot.hpp"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs(
        "usage: waymark-watchdog COMMAND\n"
        "Holds the wire between `waymark` and the process of a robot, and stops the robot when `waymark` is\n"
        "gone, frozen or silent. Started by `waymark --robot process:COMMAND`; nobody needs to start it.\n",
        stderr);
    return 125;
  }
  return waymark::watch_robot(argv[1]);
}
