#pragma once

#include <optional>

#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
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

}  // namespace waymark
