#pragma once

#include <functional>

#include "waymark/robots/process/process_robot.hpp"
#include "waymark/runtime/commission_motion.hpp"

/// Stops caused by failures, in real time: commands cease, the driving process is killed, data cease.
namespace waymark {

struct StopTrial {
  VelocityCommand command{.speed_m_s = 0.1};
  double drives_s = 1.2;
  double watched_s = 1.5;  ///< time of observation after the stop
  std::function<bool()> cancelled = [] { return false; };
};

/// Drives and then sends no more commands. Fails if the robot's process ends or the trial is cancelled; the
/// last command is then zero.
[[nodiscard]] Result<MotionTrace> fall_silent(ProcessRobot& robot, const StopTrial& trial);

/// Drives from a child process and kills that process (SIGKILL). Afterwards the watchdog ends the robot's
/// process; the trace contains its data until then. Fails if cancelled; the driving process is killed then
/// too.
[[nodiscard]] Result<MotionTrace> kill_driver(ProcessRobot& robot, const StopTrial& trial);

/// Commands zero until no odometry arrives for half a second. Returns the time from the last odometry to the
/// detection of the silence [s]; nothing if odometry arrived for `most_s`. The end of the robot's process
/// counts as silence.
[[nodiscard]] Result<std::optional<double>> await_silence(ProcessRobot& robot, double most_s,
                                                          const std::function<bool()>& cancelled);

/// Commands zero for this time and returns the robot's data.
[[nodiscard]] Result<MotionTrace> observe_at_rest(ProcessRobot& robot, double seconds,
                                                  const std::function<bool()>& cancelled);

}  // namespace waymark
