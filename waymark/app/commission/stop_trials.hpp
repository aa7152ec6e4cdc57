#pragma once

#include <functional>

#include "waymark/robots/process/process_robot.hpp"
#include "waymark/runtime/commission_motion.hpp"

/// Stops that no session asks for: the commands cease, the driving process is killed, the data cease. In real
/// time.
namespace waymark {

struct StopTrial {
  VelocityCommand command{.speed_m_s = 0.1};
  double drives_s = 1.2;
  double watched_s = 1.5;  ///< afterwards
  std::function<bool()> cancelled = [] { return false; };
};

/// Drives and then says nothing more. Fails where the robot's process ends, and when it is cancelled: the
/// last command is then zero.
[[nodiscard]] Result<MotionTrace> fall_silent(ProcessRobot& robot, const StopTrial& trial);

/// Lets a process of its own drive, and kills it (SIGKILL). The robot's process has ended afterwards, as its
/// watchdog ends it; what it said until then is in the trace. Fails when it is cancelled: the driving process
/// is then killed as well.
[[nodiscard]] Result<MotionTrace> kill_driver(ProcessRobot& robot, const StopTrial& trial);

/// Commands zero until no odometry comes for half a second: how long after the last the silence was noticed
/// [s]; nothing where it came for `most_s`. The end of the robot's process counts as silence.
[[nodiscard]] Result<std::optional<double>> await_silence(ProcessRobot& robot, double most_s,
                                                          const std::function<bool()>& cancelled);

/// Commands zero for a while, and gives what the robot said.
[[nodiscard]] Result<MotionTrace> look_at(ProcessRobot& robot, double seconds,
                                          const std::function<bool()>& cancelled);

}  // namespace waymark
