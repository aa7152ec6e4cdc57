#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/robots/watchdog/robot_command.hpp"

namespace waymark {

/// Where the watchdog's program is: beside the program that runs, or in the libexec it was installed to.
[[nodiscard]] Result<std::string> find_watchdog();

/// A robot's process behind a watchdog: what a driver of a robot holds. However this process ends, the robot
/// is told to stop.
class WatchedProcess {
 public:
  /// Starts the watchdog and, by it, `command`. `watchdog`: its program; found when empty.
  /// From then on SIGPIPE is ignored in this process: that the watchdog is gone is an error of send().
  static Result<std::unique_ptr<WatchedProcess>> start(const RobotCommand& command,
                                                       const std::string& watchdog = {});
  /// Stops the robot and waits for the watchdog, which ends the robot's process.
  ~WatchedProcess();
  WatchedProcess(const WatchedProcess&) = delete;
  WatchedProcess& operator=(const WatchedProcess&) = delete;

  /// Never waits: when the watchdog does not read, the command is lost, and the watchdog will stop the robot.
  /// Fails when the watchdog is gone and read() has said so.
  Status send(double speed_m_s, double yaw_rate_rad_s, std::int64_t step = 0);
  /// What the robot said since the last call; waits up to `most` for the first line. Fails, and says how the
  /// robot's process ended, when it has ended and everything was read.
  [[nodiscard]] Result<std::vector<Line>> read(Duration most);
  /// Stops the robot and ends its process. The exit code of the robot's process, as watch_robot() gives it.
  int close();

  /// Lets a child of this process give the commands from now on, the same one again and again, and nobody
  /// else: whoever kills it does to the robot what the end of a driving process does. It ends after
  /// `most_s` by itself, and with this process. Its process id; the caller waits for it. read() goes on.
  [[nodiscard]] Result<pid_t> drive_from_child(double speed_m_s, double yaw_rate_rad_s, double most_s);

  [[nodiscard]] pid_t watchdog_pid() const { return watchdog_.pid; }

 private:
  WatchedProcess(Spawned watchdog, std::string command)
      : watchdog_(std::move(watchdog)), command_(std::move(command)) {}
  [[nodiscard]] Error ended();

  Spawned watchdog_;
  std::string command_;
  LineSplitter lines_{};
  std::int64_t sequence_ = 0;
  std::optional<int> exit_code_{};
  bool watchdog_died_ = false;  ///< by a signal: what it says of the robot's process is not known
};

}  // namespace waymark
