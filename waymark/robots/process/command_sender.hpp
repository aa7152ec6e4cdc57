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
  Duration period = std::chrono::milliseconds(40);    ///< maximum time between messages
  Duration timeout = std::chrono::milliseconds(250);  ///< maximum age of a command, after which zero is sent
};

/// Forwards each command immediately and repeats it periodically; sends zero if no command has arrived within
/// the timeout. Pure: `now` is a steady clock and must not decrease.
class CommandRepeat {
 public:
  explicit CommandRepeat(const CommandRepeatOptions& options = {}) : options_(options) {}

  void offer(const VelocityCommand& command, Duration now);
  /// The command to publish now; `nullopt` if none is due. Zero before the first command.
  [[nodiscard]] std::optional<VelocityCommand> due(Duration now);
  /// Time until the next command is due.
  [[nodiscard]] Duration wait(Duration now) const;

 private:
  CommandRepeatOptions options_;
  VelocityCommand command_{};
  Duration given_{};
  std::optional<Duration> published_{};
  bool fresh_ = false;  ///< received but not yet published
};

/// Another program is regarded as driving if it sends at least this many commands. A single command may have
/// been in flight when its sender ended.
inline constexpr int kMinCommandsOfDriver = 2;

/// Detects whether another program commands the robot, between the first message from the robot and the first
/// command sent to it. A robot with two senders would alternately obey both.
class SenderWatch {
 public:
  /// `shares`: whether other programs may also command the robot, in which case nothing is checked. `listen`:
  /// duration of the check; the default covers ten commands from another Waymark program.
  explicit SenderWatch(bool shares, Duration listen = std::chrono::milliseconds(400))
      : listen_(shares ? Duration(0) : listen) {}

  /// To be called for each message from the robot, with its arrival time on the steady clock.
  void on_robot_message(Duration now) {
    if (!robot_since_) robot_since_ = now;
  }
  /// To be called for each command from another program.
  void on_other_command() { commands_ += robot_since_ ? 1 : 0; }

  [[nodiscard]] bool has_robot() const { return robot_since_.has_value(); }
  /// Whether the robot has sent a message and the check is complete.
  [[nodiscard]] bool done(Duration now) const { return robot_since_ && now - *robot_since_ >= listen_; }
  /// Fails if another program commands the robot. `where` is the channel or topic of the commands, `who`
  /// their sender (empty if unknown), and `start` the verb of the robot process, for the hint.
  [[nodiscard]] Status check_alone(const std::string& where, const std::string& who,
                                   const std::string& start) const;

 private:
  Duration listen_;
  std::optional<Duration> robot_since_{};
  int commands_ = 0;
};

/// The name of this process as shown to other programs, such as "waymark (process 4711 on limo-7)".
[[nodiscard]] std::string name_of_this_process();

/// The role after an order; it is determined by the first hello or velocity.
[[nodiscard]] InputRole role_after(InputRole role, const RobotOrderLine& order);

/// Sends the orders from an input (docs/formats/robot-process.md) on its own thread, at least 25 times a
/// second. It sends zero if they cease, and zero four times when the input ends. Nothing is sent until the
/// input's role is Drives, and nothing at all if it only listens.
class CommandSender {
 public:
  /// `send` sends a command to the robot; it is called on the sender's thread. `role` is the role so far
  /// (EarlyInput). Makes the wire's input non-blocking.
  CommandSender(std::function<void(const VelocityCommand&)> send, const RobotWire& wire,
                InputRole role = InputRole::Unknown);
  /// Stops the robot.
  ~CommandSender();
  CommandSender(const CommandSender&) = delete;
  CommandSender& operator=(const CommandSender&) = delete;

  /// Whether the input has ended or contained a bye.
  [[nodiscard]] bool ended() const { return ended_; }
  /// Whether the input contained a bye.
  [[nodiscard]] bool received_bye() const { return received_bye_; }
  [[nodiscard]] InputRole role() const { return role_; }
  /// While held, zero is sent instead of the orders; used when the robot is silent.
  void hold(bool held) { held_ = held; }

 private:
  void run();

  std::function<void(const VelocityCommand&)> send_;
  int input_;
  std::atomic<InputRole> role_;
  std::atomic<bool> held_ = false;
  std::atomic<bool> received_bye_ = false;
  std::atomic<bool> ended_ = false;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

/// The input of a robot process before its hello. Orders and the end of the input are ignored, because an
/// input from /dev/null ends immediately.
class EarlyInput {
 public:
  /// Makes the wire's input non-blocking.
  explicit EarlyInput(const RobotWire& wire);

  /// Reads the available input; returns whether it contained a bye.
  [[nodiscard]] bool received_bye();
  /// The role so far.
  [[nodiscard]] InputRole role() const { return role_; }

 private:
  int input_;
  InputRole role_;
  LineSplitter lines_{};
};

}  // namespace waymark
