#pragma once

#include <optional>
#include <string>
#include <variant>

#include "waymark/base/error.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Words of a robot for whoever drives it.
struct RobotText {
  std::string text{};
};

/// A robot in lockstep asks for its next command: its time stands still until it gets one.
struct CommandRequest {
  SensorTime stamp{};
};

/// Anything that comes from a robot.
using RobotEvent = std::variant<Sample, RobotText, CommandRequest>;

/// Whatever makes samples as time passes: a simulator, a live robot.
class Source {
 public:
  virtual ~Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  /// What comes next, waiting for no longer than `most`; nothing: not within that time. Fails when there will
  /// be no more, and says why.
  virtual Result<std::optional<RobotEvent>> next(Duration most) = 0;
  /// Whether next() would give something without waiting.
  [[nodiscard]] virtual bool more() const = 0;
  /// What the robot's clock shows now; nothing before the first sample.
  [[nodiscard]] virtual std::optional<SensorTime> now() const = 0;

 protected:
  Source() = default;
};

/// Whatever takes commands. A robot must stop by itself when commands cease (watchdog).
class Robot {
 public:
  virtual ~Robot() = default;
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  virtual Status command(const VelocityCommand& command) = 0;
  /// The drive is over, whatever ended it, and its last command was zero. For robots that obey a command only
  /// when they are asked for samples the next time, which will not come.
  virtual void finish() {}

 protected:
  Robot() = default;
};

}  // namespace waymark
