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

/// Path of the watchdog program, either in the folder of this program or in the installed libexec folder.
[[nodiscard]] Result<std::string> find_watchdog();

/// A robot process behind a watchdog, for robot drivers. The watchdog stops the robot however this process
/// ends.
class WatchedProcess {
 public:
  /// Starts the watchdog, which starts `command`. `watchdog` is the path of its program; if empty,
  /// find_watchdog() is used. From then on, SIGPIPE is ignored in this process, so that send() fails if the
  /// watchdog has ended.
  static Result<std::unique_ptr<WatchedProcess>> start(const RobotCommand& command,
                                                       const std::string& watchdog = {});
  /// Stops the robot and waits for the watchdog, which ends the robot process.
  ~WatchedProcess();
  WatchedProcess(const WatchedProcess&) = delete;
  WatchedProcess& operator=(const WatchedProcess&) = delete;

  /// Does not block: if the watchdog is not reading, the command is lost, and the watchdog stops the robot.
  /// Fails if the watchdog has ended and read() has returned that error.
  Status send(double speed_m_s, double yaw_rate_rad_s, std::int64_t step = 0);
  /// The lines from the robot since the last call; waits up to `timeout` for the first one. Fails with the
  /// reason once the robot process has ended and everything has been read.
  [[nodiscard]] Result<std::vector<Line>> read(Duration timeout);
  /// Stops the robot and ends its process. Returns its exit code, like watch_robot().
  int close();

  /// Starts a child process that repeats one command; from then on, only the child sends commands. Killing it
  /// has the same effect on the robot as when a driving process ends. It ends after `duration_s` or when this
  /// process ends. Returns its process id; the caller must wait for the process. read() can still be used.
  [[nodiscard]] Result<pid_t> drive_from_child(double speed_m_s, double yaw_rate_rad_s, double duration_s);

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
  bool watchdog_died_ = false;  ///< ended by a signal, so it is unknown how the robot process ended
};

}  // namespace waymark
