#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
#include "waymark/inputs/keyboard/terminal_keys.hpp"
#include "waymark/runtime/operator_input.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Actions assigned to keys.
enum class DriverKey : std::uint8_t { Forward, Back, Left, Right, Stop, Finish };

/// Parses bytes from a terminal: w a s d, arrows, space (stop), q or Escape alone (finish). Other keys are
/// skipped. An incomplete key sequence stays in `bytes` for the next call.
[[nodiscard]] std::vector<DriverKey> take_keys(std::string& bytes);

struct KeyboardOptions {
  double speed_m_s = 0.3;
  double yaw_rate_rad_s = 0.6;
  double hold_s = 0.6;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.speed_m_s, Field{"speed_m_s", "Speed while the forward key is held.", 0.01, 5});
    visit(self.yaw_rate_rad_s,
          Field{"yaw_rate_rad_s", "Yaw rate while the left or right key is held.", 0.01, 10});
    visit(self.hold_s, Field{"hold_s",
                             "Time without a key after which the robot stops; longer than the delay before a "
                             "terminal repeats a held key.",
                             0.05, 5});
  }
};

/// Converts keys to commands. A terminal repeats only the key pressed last, so forward and back continue
/// while any key is held. Left and right turn while they are held; forward drives straight again. If no key
/// arrives for hold_s, the robot stops (dead-man switch).
class KeyDriver {
 public:
  explicit KeyDriver(const KeyboardOptions& options) : options_(options) {}

  /// `now` is the time since an arbitrary fixed moment and must not decrease.
  void press(DriverKey key, Duration now);
  /// The current command; empty once the finish key has been pressed.
  [[nodiscard]] std::optional<VelocityCommand> drive(Duration now) const;

 private:
  KeyboardOptions options_;
  std::optional<Duration> last_key_{};
  std::optional<Duration> last_turn_{};
  double forward_ = 0;
  double left_ = 0;
  bool finished_ = false;
};

/// Drives a lap with the keys of a terminal.
class KeyLapDriver final : public LapDriver {
 public:
  KeyLapDriver(std::unique_ptr<TerminalKeys> keys, double speed_m_s)
      : keys_(std::move(keys)), driver_({.speed_m_s = speed_m_s}) {}

  Result<DriverDecision> drive(Duration uptime, SensorTime now) override;
  [[nodiscard]] std::string usage() const override {
    return "hold w a s d or arrows to drive; space stops, q ends the lap";
  }

 private:
  std::unique_ptr<TerminalKeys> keys_;
  KeyDriver driver_;
  std::string bytes_{};
};

/// An operator who uses the keys of a terminal.
class KeyInput final : public OperatorInput {
 public:
  KeyInput(std::unique_ptr<TerminalKeys> keys, double speed_m_s)
      : keys_(std::move(keys)), driver_({.speed_m_s = speed_m_s}) {}

  Result<OperatorRequest> read(Duration uptime, SensorTime now, OperatorState state) override;
  [[nodiscard]] std::string usage() const override {
    return "y continues, b or space stops, q ends the session; to teach, hold w a s d or arrows to drive";
  }
  [[nodiscard]] OperatorButtons buttons(OperatorState /*state*/) const override {
    return {"y", "b", "hold w a s d or arrows to drive"};
  }

 private:
  std::unique_ptr<TerminalKeys> keys_;
  KeyDriver driver_;
  std::string bytes_{};
};

}  // namespace waymark
