#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "waymark/app/robot/plant.hpp"
#include "waymark/robots/watchdog/robot_command.hpp"

namespace waymark {

struct ProcessPlantOptions {
  std::vector<std::string> sends{};  ///< types of lines without which it is of no use; empty: any
  double watchdog_s = 0.5;           ///< commands that cease for so long make it stop
  std::function<bool()> should_stop = [] { return false; };
  std::function<void(const std::string&)> on_text = [](const std::string&) {};  ///< what it has to say
};

/// A simulation of somebody else's that speaks the protocol of robot processes
/// (docs/formats/robot-process.md): of its physics and sensors nothing is known here. One in lockstep goes on
/// with each command; one that does not is taken as fast as it speaks. Its stamps begin at zero. Fails when
/// it says no hello, or does not send what is needed.
[[nodiscard]] Result<std::unique_ptr<Plant>> start_process_plant(const RobotCommand& command,
                                                                 const ProcessPlantOptions& options);

}  // namespace waymark
