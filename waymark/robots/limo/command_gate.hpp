#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/robots/limo/limo_messages.hpp"

namespace waymark {

/// Decides, based on the state reported by LIMO, which commands are sent. Zero is sent
/// - until LIMO reports that it accepts commands from this port. If it stops doing so (remote control), until
/// it does
///   again and the driver has commanded zero once;
/// - during an emergency stop or errors in motors, steering or drive, likewise;
/// - while LIMO does not report its motion;
/// - if its drive differs from the one in the robot file.
/// Pure: `now` is a steady clock. Every stop is reported once.
class CommandGate {
 public:
  /// `file` is the drive in the robot file.
  explicit CommandGate(LimoDrive file) : file_(file) {}

  void receive(const LimoMotion& motion, Duration now);
  void receive(const LimoState& state, Duration now);

  /// The command to send now, which is either `asked` or zero.
  [[nodiscard]] VelocityCommand pass(const VelocityCommand& asked, Duration now);
  /// Whether to request control of LIMO now: at the beginning, and later only while the driver commands zero
  /// and LIMO is stationary. This avoids competing with someone who uses the remote control.
  [[nodiscard]] bool asks_for_command(Duration now);
  /// The drive for which commands are encoded.
  [[nodiscard]] LimoDrive drive() const;
  /// Whether LIMO has reported its state and motion and accepts commands.
  [[nodiscard]] bool ready() const { return obeyed_ && motion_received_.has_value(); }
  /// Whether LIMO has reported its state and motion, even if it does not accept commands.
  [[nodiscard]] bool has_state() const { return state_.has_value() && motion_received_.has_value(); }
  [[nodiscard]] const std::optional<LimoState>& state() const { return state_; }
  /// The reports since the last call.
  [[nodiscard]] std::vector<std::string> take_reports() { return std::exchange(pending_, {}); }

 private:
  void stop(const std::string& why);
  void report_errors(std::uint16_t errors);

  LimoDrive file_;
  std::optional<LimoState> state_{};
  std::optional<LimoState> unconfirmed_{};  ///< received only once, so it may be a damaged frame
  std::optional<Duration> motion_received_{};
  bool stationary_ = true;
  bool asked_zero_ = true;
  bool obeyed_ = false;   ///< whether LIMO has accepted commands at least once
  bool stopped_ = false;  ///< stopped until the driver has commanded zero
  bool silent_ = false;
  std::optional<Duration> asked_at_{};
  std::uint16_t reported_errors_ = 0;
  std::vector<std::string> pending_{};
};

}  // namespace waymark
