#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/robots/process/robot_clock.hpp"
#include "waymark/robots/process/robot_messages.hpp"
#include "waymark/robots/watchdog/watched_process.hpp"
#include "waymark/samples/robot.hpp"

namespace waymark {

struct ProcessRobotOptions {
  Duration hello_within = std::chrono::seconds(15);
  std::string watchdog{};              ///< path of the watchdog program; searched for if empty
  std::vector<std::string> cameras{};  ///< names of the robot's cameras; any if empty
  std::function<bool()> should_stop = [] { return false; };  ///< called while waiting for the hello
  std::function<void(const std::string&)> on_waiting = [](const std::string&) {
  };  ///< called once, after one second
};

/// A robot that runs as a child process (docs/formats/robot-process.md) behind the watchdog.
class ProcessRobot final : public Source, public Robot {
 public:
  /// Starts the process and waits for its hello.
  static Result<std::unique_ptr<ProcessRobot>> start(const RobotCommand& command,
                                                     const ProcessRobotOptions& options = {});

  [[nodiscard]] const RobotHello& hello() const { return hello_; }
  /// Warnings about skipped lines and keys are returned as text. Fails if a line is invalid. When the process
  /// ends, fails with the reason.
  Result<std::optional<RobotEvent>> next(Duration timeout) override;
  [[nodiscard]] bool more() const override { return !waiting_.empty() || !texts_.empty(); }
  /// Does not block. If the robot runs in lockstep, answers its newest step.
  Status command(const VelocityCommand& command) override;
  /// In lockstep, the timestamp of the newest step.
  [[nodiscard]] std::optional<SensorTime> now() const override;
  /// Calls WatchedProcess::drive_from_child(), which starts a process that a test can kill. next() keeps
  /// working until the watchdog has ended the robot process.
  [[nodiscard]] Result<pid_t> drive_from_child(const VelocityCommand& command, double duration_s) {
    return wire_->drive_from_child(command.speed_m_s, command.yaw_rate_rad_s, duration_s);
  }
  /// Stops the robot and ends its process. No other function may be called afterwards.
  void close() { (void)wire_->close(); }

 private:
  ProcessRobot(std::unique_ptr<WatchedProcess> wire, const RobotCommand& command,
               std::vector<std::string> cameras)
      : wire_(std::move(wire)), reader_("process:" + command.text(), std::move(cameras)) {}
  [[nodiscard]] Result<std::optional<RobotMessage>> next_message(Duration timeout);
  [[nodiscard]] Error with_last_log(Error error) const;

  std::unique_ptr<WatchedProcess> wire_;
  RobotMessageReader reader_;
  RobotHello hello_{};
  struct Arrived {
    Line line;
    Duration at{};
  };
  std::deque<Arrived> waiting_{};
  std::deque<std::string> texts_{};
  std::string last_log_{};              ///< the last log line, if it is the newest message
  std::optional<SensorTime> newest_{};  ///< newest timestamp of a sample
  ArrivalClock clock_{};
  RobotStep step_{};
};

}  // namespace waymark
