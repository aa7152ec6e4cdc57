#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
#include "waymark/inputs/gamepad/gamepad.hpp"
#include "waymark/runtime/operator_input.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Settings for driving with sticks and buttons, whose numbers are defined in gamepad.hpp.
struct GamepadOptions {
  double speed_m_s = 0.5;
  double yaw_rate_rad_s = 1.0;
  double dead_zone = 0.1;
  double silence_s = 0.25;
  int speed_axis = 1;
  int yaw_axis = 2;
  int dead_man_button = 9;
  int finish_button = 3;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.speed_m_s, Field{"speed_m_s", "Speed at full forward deflection of the stick.", 0.01, 5});
    visit(self.yaw_rate_rad_s,
          Field{"yaw_rate_rad_s", "Yaw rate at full left deflection of the stick.", 0.01, 10});
    visit(
        self.dead_zone,
        Field{"dead_zone",
              "Deflection below which the stick counts as centred, as a share of full deflection.", 0, 0.9});
    visit(self.silence_s,
          Field{"silence_s", "Time without an event of the gamepad after which the robot stops.", 0.01, 5});
    visit(self.speed_axis,
          Field{"speed_axis", "Number of the axis that sets the speed; 1 is the left stick.", 0, 31});
    visit(self.yaw_axis,
          Field{"yaw_axis", "Number of the axis that sets the yaw rate; 2 is the right stick.", 0, 31});
    visit(self.dead_man_button,
          Field{"dead_man_button",
                "Number of the dead-man button, which must be held to move; 9 is the left shoulder.", 0, 31});
    visit(self.finish_button,
          Field{"finish_button", "Number of the button that ends the lap; 3 is Y, or the triangle.", 0, 31});
  }
};

/// Converts the state of a gamepad to commands.
class StickDriver {
 public:
  explicit StickDriver(const GamepadOptions& options) : options_(options) {}

  /// Sets the state of the gamepad. A missing axis is centred, a missing button is not pressed.
  void add(const GamepadState& state);
  /// The current command; empty once the button that ends the lap has been pressed. Zero if the dead-man
  /// button is not held or the gamepad has sent nothing for silence_s.
  [[nodiscard]] std::optional<VelocityCommand> drive(SensorTime now) const;

 private:
  GamepadOptions options_;
  std::optional<GamepadState> state_{};
  bool finished_ = false;
};

/// A gamepad that may be unplugged and plugged in again during use.
class HeldPad {
 public:
  /// The current state. While the gamepad is unplugged, and afterwards until its dead-man button is released
  /// once, sticks are reported as centred and buttons as not pressed.
  struct Poll {
    GamepadState state{};
    bool there = true;
    std::vector<std::string> messages{};  ///< messages about disconnection and reconnection
  };

  /// `dead_man_button` is a button number as defined in gamepad.hpp.
  HeldPad(std::unique_ptr<Gamepad> pad, int dead_man_button)
      : pad_(std::move(pad)), dead_man_button_(dead_man_button) {}

  [[nodiscard]] Poll poll(SensorTime now);
  /// Shows the signal if it differs from the current one, or after reconnection.
  void show(const PadSignal& signal);

 private:
  std::unique_ptr<Gamepad> pad_;
  int dead_man_button_;
  bool there_ = true;
  bool let_go_ = true;
  std::optional<PadSignal> shown_{};
};

/// Drives a lap with a gamepad.
class PadLapDriver final : public LapDriver {
 public:
  PadLapDriver(std::unique_ptr<Gamepad> pad, double speed_m_s)
      : pad_(std::move(pad), GamepadOptions{}.dead_man_button), driver_({.speed_m_s = speed_m_s}) {}

  Result<DriverDecision> drive(Duration uptime, SensorTime now) override;
  [[nodiscard]] std::string usage() const override {
    return "hold the left shoulder button; left stick: speed, right stick: turn; Y (triangle) ends the lap";
  }

 private:
  HeldPad pad_;
  StickDriver driver_;
};

/// The light and rumble for a session state: blue while teaching, green while replaying, red if a replay
/// ended before its goal. The gamepad rumbles when a replay pauses or ends.
[[nodiscard]] PadSignal signal_of(OperatorState state);

/// An operator who uses a gamepad. A replay pauses when the gamepad is unplugged.
class PadInput final : public OperatorInput {
 public:
  PadInput(std::unique_ptr<Gamepad> pad, double speed_m_s)
      : pad_(std::move(pad), GamepadOptions{}.dead_man_button),
        driver_({.speed_m_s = speed_m_s, .finish_button = kNoButton}) {}

  Result<OperatorRequest> read(Duration uptime, SensorTime now, OperatorState state) override;
  [[nodiscard]] std::string usage() const override {
    return "Y (triangle) continues, B (circle) stops, back ends the session; to teach, hold the left "
           "shoulder "
           "button and drive with the sticks";
  }

 private:
  static constexpr int kNoButton = 31;
  HeldPad pad_;
  StickDriver driver_;
  OperatorPad events_{};
  std::optional<Duration> pause_asked_{};
};

}  // namespace waymark
