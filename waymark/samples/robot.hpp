#pragma once

#include <optional>
#include <string>
#include <variant>

#include "waymark/base/error.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A message of a robot to its operator.
struct RobotText {
  std::string text{};
};

/// A robot in lockstep requests its next command: its time does not advance until it receives one.
struct CommandRequest {
  SensorTime stamp{};
};

/// Any event from a robot.
using RobotEvent = std::variant<Sample, RobotText, CommandRequest>;

/// A source of samples over time: a simulator or a live robot.
class Source {
 public:
  virtual ~Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  /// The next event, waiting at most `most`; nothing if none arrives within that time. Fails with the reason
  /// if there will be no more events.
  virtual Result<std::optional<RobotEvent>> next(Duration most) = 0;
  /// Whether next() would return an event without waiting.
  [[nodiscard]] virtual bool more() const = 0;
  /// The current time of the robot's clock; nothing before the first sample.
  [[nodiscard]] virtual std::optional<SensorTime> now() const = 0;

 protected:
  Source() = default;
};

/// A receiver of commands. A robot must stop by itself when commands cease (watchdog).
class Robot {
 public:
  virtual ~Robot() = default;
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  virtual Status command(const VelocityCommand& command) = 0;
  /// Called when the drive is over, for any reason; its last command was zero. Needed for robots that execute
  /// a command only on the next request for samples, which will not happen again.
  virtual void finish() {}

 protected:
  Robot() = default;
};

}  // namespace waymark
