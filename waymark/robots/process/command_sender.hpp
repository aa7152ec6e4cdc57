#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "waymark/robots/process/command_repeat.hpp"
#include "waymark/robots/process/robot_messages.hpp"
#include "waymark/robots/process/robot_wire.hpp"
#include "waymark/robots/watchdog/lines.hpp"

namespace waymark {

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
