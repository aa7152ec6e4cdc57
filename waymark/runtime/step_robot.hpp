#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "waymark/runtime/robot_loop.hpp"
#include "waymark/samples/robot.hpp"

namespace waymark {

/// A robot defined by one function, which executes the newest command for one period and returns the samples
/// from that period. A new command is requested after each call (lockstep). It is suitable for simulators and
/// for polled hardware; for hardware, the function waits until the period is over. When a drive ends for any
/// reason and the last command was not zero, the function is called once more with zero. A robot that sends
/// asynchronously should implement Source and Robot instead.
class StepRobot final : public Source, public Robot {
 public:
  /// `now` is the end of the period, on the clock used for the timestamps of the samples. An error ends the
  /// drive.
  using Step = std::function<Result<std::vector<Sample>>(const VelocityCommand& command, SensorTime now)>;

  explicit StepRobot(Step step, Duration period = std::chrono::milliseconds(50));

  Status command(const VelocityCommand& command) override;
  void finish() override;
  Result<std::optional<RobotEvent>> next(Duration most) override;
  [[nodiscard]] bool more() const override { return !events_.empty(); }
  [[nodiscard]] std::optional<SensorTime> now() const override { return SensorTime(clock_); }

  /// The clock of this robot, to be used by RobotLoop. The robot must outlive it.
  [[nodiscard]] Pacing pacing() const;

 private:
  Step step_;
  Duration period_;
  Duration clock_{};
  VelocityCommand command_{};
  VelocityCommand obeyed_{};
  std::deque<RobotEvent> events_{};
};

}  // namespace waymark
