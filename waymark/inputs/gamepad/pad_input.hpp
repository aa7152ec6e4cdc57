#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/inputs/gamepad/gamepad.hpp"
#include "waymark/inputs/gamepad/stick_driver.hpp"
#include "waymark/runtime/operator_input.hpp"

namespace waymark {

/// A pad that may be unplugged and plugged in again while it is used.
class HeldPad {
 public:
  /// What it says now. While it is unplugged, and until its dead-man button was let go once it is back, as a
  /// pad that nobody touches.
  struct Poll {
    GamepadState state{};
    bool there = true;
    std::vector<std::string> words{};  ///< that it went or came, once each time
  };

  /// `dead_man_button`: its number, as gamepad.hpp has it.
  HeldPad(std::unique_ptr<Gamepad> pad, int dead_man_button)
      : pad_(std::move(pad)), dead_man_button_(dead_man_button) {}

  [[nodiscard]] Poll poll(SensorTime now);
  /// Shows what differs from what is shown, and again on a pad that came back.
  void show(const PadSignal& signal);

 private:
  std::unique_ptr<Gamepad> pad_;
  int dead_man_button_;
  bool there_ = true;
  bool let_go_ = true;
  std::optional<PadSignal> shown_{};
};

/// A person who drives a lap with a gamepad.
class PadLapDriver final : public LapDriver {
 public:
  PadLapDriver(std::unique_ptr<Gamepad> pad, double speed_m_s)
      : pad_(std::move(pad), GamepadOptions{}.dead_man_button), driver_({.speed_m_s = speed_m_s}) {}

  Result<DriverDecision> drive(Duration uptime, SensorTime now) override;
  [[nodiscard]] std::string usage() const override {
    return "hold the left shoulder; left stick speed, right stick turn, Y (triangle) ends the lap";
  }

 private:
  HeldPad pad_;
  StickDriver driver_;
};

/// The light and the rumble of a state of the session: blue while teaching, green while replaying, red where
/// a replay was ended before its goal; it rumbles when a replay pauses or ends.
[[nodiscard]] PadSignal signal_of(OperatorState state);

/// An operator with a gamepad. A replay pauses when the pad is unplugged.
class PadInput final : public OperatorInput {
 public:
  PadInput(std::unique_ptr<Gamepad> pad, double speed_m_s)
      : pad_(std::move(pad), GamepadOptions{}.dead_man_button),
        driver_({.speed_m_s = speed_m_s, .finish_button = kNoButton}) {}

  Result<OperatorRequest> read(Duration uptime, SensorTime now, OperatorState state) override;
  [[nodiscard]] std::string usage() const override {
    return "Y (triangle) goes on, B (circle) stops, back ends; teaching: hold the left shoulder, sticks "
           "drive";
  }

 private:
  static constexpr int kNoButton = 31;
  HeldPad pad_;
  StickDriver driver_;
  OperatorPad events_{};
  std::optional<Duration> pause_asked_{};
};

}  // namespace waymark
