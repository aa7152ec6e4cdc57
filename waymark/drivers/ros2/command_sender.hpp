#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "waymark/drivers/dds/bus.hpp"
#include "waymark/drivers/ros2/command_repeat.hpp"

namespace waymark {

/// The bytes of a command's message.
using EncodeCommand = std::function<std::vector<std::uint8_t>(const VelocityCommand&)>;

/// Publishes the orders that come on an input (docs/formats/robot-process.md), on a thread of its own that
/// waits for nobody else, at least 25 times a second; zero when they cease, and four times zero when the
/// input ends.
class CommandSender {
 public:
  /// `bus` outlives this; `input` is read without waiting from now on.
  CommandSender(Bus& bus, std::size_t publisher, EncodeCommand encode, int input);
  /// Stops the robot.
  ~CommandSender();
  CommandSender(const CommandSender&) = delete;
  CommandSender& operator=(const CommandSender&) = delete;

  /// The input ended, or said that it is over.
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  void run();
  void publish(const VelocityCommand& command);

  Bus& bus_;
  std::size_t publisher_;
  EncodeCommand encode_;
  int input_;
  std::atomic<bool> ended_ = false;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace waymark
