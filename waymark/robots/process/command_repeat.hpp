#pragma once

#include <optional>

#include "waymark/base/time.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

struct CommandRepeatOptions {
  Duration period = std::chrono::milliseconds(40);    ///< between messages, at most
  Duration timeout = std::chrono::milliseconds(250);  ///< a command that is older does not drive
};

/// Keeps the commands of a robot coming: passes each command on at once, repeats it, and zero when none came
/// within the timeout. Pure: `now` is a steady clock that never goes back.
class CommandRepeat {
 public:
  explicit CommandRepeat(const CommandRepeatOptions& options = {}) : options_(options) {}

  void offer(const VelocityCommand& command, Duration now);
  /// What is to be published now; nothing when nothing is due. Zero before the first command.
  [[nodiscard]] std::optional<VelocityCommand> due(Duration now);
  /// How long until something is due.
  [[nodiscard]] Duration wait(Duration now) const;

 private:
  CommandRepeatOptions options_;
  VelocityCommand command_{};
  Duration given_{};
  std::optional<Duration> published_{};
  bool fresh_ = false;  ///< given and not yet published
};

}  // namespace waymark
