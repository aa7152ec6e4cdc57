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

/// Which sticks and buttons do what. Numbers are those of gamepad.hpp.
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

/// A person with a gamepad in hand.
class StickDriver {
 public:
  explicit StickDriver(const GamepadOptions& options) : options_(options) {}

  /// What the pad says. An axis or button that it does not have is in the middle, not pressed.
  void add(const GamepadState& state);
  /// The command now; nothing once the driver pressed the button that ends the lap. All zero without the dead
  /// man's button, and when the pad has been silent for silence_s.
  [[nodiscard]] std::optional<VelocityCommand> drive(SensorTime now) const;

 private:
  GamepadOptions options_;
  std::optional<GamepadState> state_{};
  bool finished_ = false;
};

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
