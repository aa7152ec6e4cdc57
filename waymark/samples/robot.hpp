#pragma once

#include <optional>

#include "waymark/base/error.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Whatever makes samples: a simulator, a live robot, a recording.
class Source {
 public:
  virtual ~Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  /// The next sample in stamp order; nothing when there will be no more.
  virtual Result<std::optional<Sample>> next() = 0;

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

 protected:
  Robot() = default;
};

}  // namespace waymark
