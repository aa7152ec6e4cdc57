#pragma once

#include <optional>
#include <string>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"

namespace waymark {

/// So many commands of another program mean that it drives: one may have been on its way when its sender
/// ended.
inline constexpr int kCommandsOfADriver = 2;

/// Whether another program commands the robot, which is listened for after the robot is heard and before
/// anything is sent to it: two senders make a robot obey both in turn.
class SenderWatch {
 public:
  /// `shares`: others may command it as well, nothing is listened for. `listen`: for how long; by default ten
  /// commands of another Waymark.
  explicit SenderWatch(bool shares, Duration listen = std::chrono::milliseconds(400))
      : listen_(shares ? Duration(0) : listen) {}

  /// The robot said something at this time of the steady clock.
  void hear_robot(Duration now) {
    if (!robot_since_) robot_since_ = now;
  }
  /// A command of somebody else came.
  void hear_command() { commands_ += robot_since_ ? 1 : 0; }

  [[nodiscard]] bool heard_robot() const { return robot_since_.has_value(); }
  /// The robot is heard, and was listened to for long enough.
  [[nodiscard]] bool done(Duration now) const { return robot_since_ && now - *robot_since_ >= listen_; }
  /// Fails when others command the robot. `where`: the channel or topic of the commands; `who` sends them, or
  /// nothing where the wire does not tell; `start`: the verb of the robot's process, for the hint.
  [[nodiscard]] Status alone(const std::string& where, const std::string& who,
                             const std::string& start) const;

 private:
  Duration listen_;
  std::optional<Duration> robot_since_{};
  int commands_ = 0;
};

/// "waymark (process 4711 on limo-7)": how this process names itself to other programs.
[[nodiscard]] std::string name_of_this_process();

}  // namespace waymark
