#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/localization/method.hpp"
#include "waymark/pipeline/operator.hpp"
#include "waymark/runtime/robot_loop.hpp"

namespace waymark {

/// Drives the lap to be taught: a person, or a script that follows a known path.
class LapDriver {
 public:
  virtual ~LapDriver() = default;
  LapDriver(const LapDriver&) = delete;
  LapDriver& operator=(const LapDriver&) = delete;

  /// Receives every sample from the robot, in order.
  virtual void receive(const Sample& /*sample*/) {}
  /// Returns the current command; `done` is true when the lap is over.
  [[nodiscard]] virtual Result<DriverDecision> drive(Duration uptime, SensorTime now) = 0;
  /// Instructions for driving, in one line; empty if none are needed.
  [[nodiscard]] virtual std::string usage() const { return {}; }

 protected:
  LapDriver() = default;
};

/// Slows down a simulated robot for a person. Before each decision, it waits until the clock of this computer
/// has advanced as far as the robot's clock.
class PacedDriver final : public LapDriver {
 public:
  /// `clock` is monotonic; `wait` returns once the duration has passed on it.
  PacedDriver(std::unique_ptr<LapDriver> driver, std::function<Duration()> clock,
              std::function<void(Duration)> wait)
      : driver_(std::move(driver)), clock_(std::move(clock)), wait_(std::move(wait)) {}

  void receive(const Sample& sample) override { driver_->receive(sample); }
  Result<DriverDecision> drive(Duration uptime, SensorTime now) override;
  [[nodiscard]] std::string usage() const override { return driver_->usage(); }

 private:
  std::unique_ptr<LapDriver> driver_;
  std::function<Duration()> clock_;
  std::function<void(Duration)> wait_;
  std::optional<Duration> start_{};
};

/// A driver that is paced by the steady clock.
[[nodiscard]] std::unique_ptr<LapDriver> in_real_time(std::unique_ptr<LapDriver> driver);

/// The operator's current input.
struct OperatorRequest {
  std::vector<OperatorEvent> events{};
  VelocityCommand command{};          ///< command from the sticks or keys, whether or not the state permits
                                      ///< it
  std::optional<GamepadState> pad{};  ///< recorded like any other sample
  std::vector<std::string>
      messages{};                   ///< messages for the operator, such as that an input was not understood
  std::optional<GivenPose> pose{};  ///< pose, as in SessionRequest
};

/// A source of the operator's buttons and sticks: a gamepad, a keyboard, another program, the page, or a
/// script.
class OperatorInput {
 public:
  virtual ~OperatorInput() = default;
  OperatorInput(const OperatorInput&) = delete;
  OperatorInput& operator=(const OperatorInput&) = delete;

  /// Called 20 times per second. Must not block. An error ends the session.
  [[nodiscard]] virtual Result<OperatorRequest> read(Duration uptime, SensorTime now,
                                                     OperatorState state) = 0;
  /// Receives every sample from the robot, because a script follows the ground truth.
  virtual void receive(const Sample& /*sample*/) {}
  /// Instructions for using it, in one line.
  [[nodiscard]] virtual std::string usage() const = 0;
  /// The names of its buttons.
  [[nodiscard]] virtual OperatorButtons buttons(OperatorState /*state*/) const { return {}; }
  /// Whether it is used by a person who can see the robot.
  [[nodiscard]] virtual bool is_person() const { return true; }
  /// Whether keys on the page drive the robot during teaching.
  [[nodiscard]] virtual bool page_drives() const { return false; }
  /// Whether a script could drive the lap now.
  [[nodiscard]] virtual bool has_script() const { return false; }

 protected:
  OperatorInput() = default;
};

/// A script that replaces the operator. It teaches one lap, replays it once, and ends the session.
class ScriptInput final : public OperatorInput {
 public:
  /// `stays` is true if the session should be left running, so that viewers can continue it.
  ScriptInput(std::unique_ptr<LapDriver> driver, bool stays) : driver_(std::move(driver)), stays_(stays) {}

  Result<OperatorRequest> read(Duration uptime, SensorTime now, OperatorState state) override;
  void receive(const Sample& sample) override { driver_->receive(sample); }
  [[nodiscard]] std::string usage() const override {
    return "a script drives the line of the world and presses the buttons";
  }
  [[nodiscard]] bool is_person() const override { return false; }

 private:
  std::unique_ptr<LapDriver> driver_;
  bool stays_;
  bool taught_ = false;
  bool replayed_ = false;
  Duration pressed_{};
};

}  // namespace waymark
