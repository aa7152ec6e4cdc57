#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/robots/process/robot_messages.hpp"
#include "waymark/robots/process/robot_wire.hpp"
#include "waymark/robots/watchdog/pipes.hpp"
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

/// The role after an order: a hello or a velocity decides it, once.
[[nodiscard]] InputRole role_after(InputRole role, const RobotOrderLine& order);

/// Sends the orders that come on an input (docs/formats/robot-process.md), on a thread of its own that
/// waits for nobody else, at least 25 times a second; zero when they cease, and four times zero when the
/// input ends. Nothing is sent before the input said that it drives, and never where it only listens.
class CommandSender {
 public:
  /// `send` puts a command on the robot's wire; it is called on the thread of the sender. `role`: what the
  /// input said before (EarlyInput). The wire's input is read without waiting from now on.
  CommandSender(std::function<void(const VelocityCommand&)> send, const RobotWire& wire,
                InputRole role = InputRole::Unknown);
  /// Stops the robot.
  ~CommandSender();
  CommandSender(const CommandSender&) = delete;
  CommandSender& operator=(const CommandSender&) = delete;

  /// The input ended, or said that it is over.
  [[nodiscard]] bool ended() const { return ended_; }
  /// The input said that it is over.
  [[nodiscard]] bool said_bye() const { return said_bye_; }
  [[nodiscard]] InputRole role() const { return role_; }
  /// While held, zero is sent whatever the orders are: for a robot that is not heard any more.
  void hold(bool held) { held_ = held; }

 private:
  void run();

  std::function<void(const VelocityCommand&)> send_;
  int input_;
  std::atomic<InputRole> role_;
  std::atomic<bool> held_ = false;
  std::atomic<bool> said_bye_ = false;
  std::atomic<bool> ended_ = false;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

/// The input of a robot's process before its hello: no order counts yet, nor does the end of an input, which
/// of `< /dev/null` is there from the beginning.
class EarlyInput {
 public:
  /// The wire's input is read without waiting from now on.
  explicit EarlyInput(const RobotWire& wire);

  /// Whether it said by now that it is over (a "bye").
  [[nodiscard]] bool said_bye();
  /// What it said by now that it is there for.
  [[nodiscard]] InputRole role() const { return role_; }

 private:
  int input_;
  InputRole role_;
  LineSplitter lines_{};
};

}  // namespace waymark
