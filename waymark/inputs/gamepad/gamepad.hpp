#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Light and rumble of a gamepad; ignored by gamepads without a light or motors.
struct PadSignal {
  std::array<std::uint8_t, 3> light_rgb{};  ///< colour of the light bar
  double rumble = 0;                        ///< strength, 0 to 1
  Duration rumble_for{};

  friend bool operator==(const PadSignal&, const PadSignal&) = default;
};

/// A device with sticks and buttons.
class Gamepad {
 public:
  virtual ~Gamepad() = default;
  Gamepad(const Gamepad&) = delete;
  Gamepad& operator=(const Gamepad&) = delete;

  /// The current state of its sticks and buttons, stamped with `now`. Fails while it is unplugged, and works
  /// again once it is plugged in.
  [[nodiscard]] virtual Result<GamepadState> poll(SensorTime now) = 0;
  virtual void show(const PadSignal& /*signal*/) {}

 protected:
  Gamepad() = default;
};

/// Opens the first connected gamepad. Whatever its make, its layout is that of an Xbox controller (from SDL's
/// database). Axes: 0 left stick, left positive; 1 left stick, forward positive; 2, 3 right stick; 4, 5
/// triggers, 0 to 1. Buttons: 0 A, 1 B, 2 X, 3 Y, 4 back, 5 guide, 6 start, 7, 8 sticks, 9, 10 shoulders, 11
/// to 14 cross up, down, left, right. Fails if no gamepad is connected or the program was built without SDL2.
[[nodiscard]] Result<std::unique_ptr<Gamepad>> open_gamepad();

}  // namespace waymark
