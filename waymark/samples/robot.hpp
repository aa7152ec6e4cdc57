#pragma once

#include <optional>
#include <string>
#include <variant>

#include "waymark/base/error.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A message from a robot to its operator.
struct RobotText {
  std::string text{};
};

/// A request for the next command from a robot in lockstep, whose time does not advance until it receives
/// one.
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

  /// The next event, waiting for at most `most`; empty if none arrives in time. Fails with the reason if
  /// there will be no more events.
  virtual Result<std::optional<RobotEvent>> next(Duration most) = 0;
  /// Whether next() would return an event without waiting.
  [[nodiscard]] virtual bool more() const = 0;
  /// The current time on the robot's clock; empty before the first sample.
  [[nodiscard]] virtual std::optional<SensorTime> now() const = 0;

 protected:
  Source() = default;
};

/// Receives commands. A robot must stop by itself when commands cease (watchdog).
class Robot {
 public:
  virtual ~Robot() = default;
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  virtual Status command(const VelocityCommand& command) = 0;
  /// Called when the drive is over for any reason; the last command was zero. Needed by robots that execute a
  /// command only on the next request for samples, which will not come.
  virtual void finish() {}

 protected:
  Robot() = default;
};

}  // namespace waymark
