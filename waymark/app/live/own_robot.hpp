#pragma once

#include <string>
#include <vector>

#include "waymark/app/live/robot_setup.hpp"

namespace waymark {

/// How a simulated robot that is a process of its own tells the time.
struct SimulatedTime {
  bool lockstep = false;  ///< it waits for its commands
  double pace = 0;        ///< in lockstep: no faster than so many seconds a second; 0: as fast as it goes
};

/// This program again, with these arguments. No shell reads them.
[[nodiscard]] Result<RobotCommand> own_program(std::vector<std::string> words);

/// Makes the setup's robot a process: this program again, as `waymark robot-sim WORDS`.
/// No shell reads the words.
[[nodiscard]] Status become_the_robot(RobotSetup& setup, std::vector<std::string> words,
                                      const SimulatedTime& time);

}  // namespace waymark
