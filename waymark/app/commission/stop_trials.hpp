#pragma once

#include <functional>

#include "waymark/robots/process/process_robot.hpp"
#include "waymark/runtime/commission_motion.hpp"

/// Tests stops caused by failures in real time: commands cease, the driving process is killed, or data cease.
namespace waymark {

struct StopTrial {
  VelocityCommand command{.speed_m_s = 0.1};
  double drives_s = 1.2;
  double watched_s = 1.5;  ///< how long the robot is observed after the stop
  std::function<bool()> cancelled = [] { return false; };
};

/// Drives, then stops sending commands. Fails if the robot's process ends or the trial is cancelled; the last
/// command sent is then zero.
[[nodiscard]] Result<MotionTrace> fall_silent(ProcessRobot& robot, const StopTrial& trial);

/// Drives from a child process and kills that process (SIGKILL). The watchdog then ends the robot's process;
/// the trace contains the data up to that time. Fails if cancelled, in which case the driving process is
/// killed as well.
[[nodiscard]] Result<MotionTrace> kill_driver(ProcessRobot& robot, const StopTrial& trial);

/// Commands zero until no odometry has arrived for half a second. Returns the time from the last odometry
/// until the silence was detected [s]; `nullopt` if odometry kept arriving for `most_s`. If the robot's
/// process ends, this counts as silence.
[[nodiscard]] Result<std::optional<double>> await_silence(ProcessRobot& robot, double most_s,
                                                          const std::function<bool()>& cancelled);

/// Commands zero for this long and returns the robot's data.
[[nodiscard]] Result<MotionTrace> observe_at_rest(ProcessRobot& robot, double seconds,
                                                  const std::function<bool()>& cancelled);

}  // namespace waymark
