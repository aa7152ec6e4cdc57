#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/robots/limo/limo_messages.hpp"

namespace waymark {

/// What of the commands reaches LIMO's wheels, by what LIMO says of itself. Zero is sent
/// - until it says that it obeys this wire, and after it stopped doing so (somebody took the remote control)
///   until it does again and the driver has asked for zero once;
/// - in emergency stop and with errors of motors, steering or drive, likewise;
/// - while nothing is heard of its motion;
/// - when its wheels are not latched as its file says.
/// Pure: `now` is a steady clock. Every stop is said in words, once.
class CommandGate {
 public:
  /// `file`: the drive that the robot's file describes.
  explicit CommandGate(LimoDrive file) : file_(file) {}

  void hear(const LimoMotion& motion, Duration now);
  void hear(const LimoState& state, Duration now);

  /// The command that may be sent now.
  [[nodiscard]] VelocityCommand pass(const VelocityCommand& asked, Duration now);
  /// Whether to ask now to be obeyed: at the beginning; later only while the driver asks for zero and the
  /// robot stands, so that nobody is fought who drives it by remote control.
  [[nodiscard]] bool asks_for_command(Duration now);
  /// How commands are encoded.
  [[nodiscard]] LimoDrive drive() const;
  /// The robot said all that must be known to drive it, and obeys.
  [[nodiscard]] bool ready() const { return obeyed_ && motion_heard_.has_value(); }
  /// The robot said all that must be known to hear it, whoever drives it.
  [[nodiscard]] bool heard() const { return state_.has_value() && motion_heard_.has_value(); }
  [[nodiscard]] const std::optional<LimoState>& state() const { return state_; }
  /// Since the last call.
  [[nodiscard]] std::vector<std::string> take_words() { return std::exchange(words_, {}); }

 private:
  void stop(const std::string& why);
  void say_errors(std::uint16_t errors);

  LimoDrive file_;
  std::optional<LimoState> state_{};
  std::optional<LimoState> doubtful_{};  ///< heard once: a damaged frame may say so
  std::optional<Duration> motion_heard_{};
  bool stands_ = true;
  bool asked_zero_ = true;
  bool obeyed_ = false;   ///< once
  bool stopped_ = false;  ///< until the driver has asked for zero
  bool silent_ = false;
  std::optional<Duration> asked_at_{};
  std::uint16_t said_errors_ = 0;
  std::vector<std::string> words_{};
};

}  // namespace waymark
