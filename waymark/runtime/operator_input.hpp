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

/// Whoever drives a lap that is taught: a person, or a script that knows the way.
class LapDriver {
 public:
  virtual ~LapDriver() = default;
  LapDriver(const LapDriver&) = delete;
  LapDriver& operator=(const LapDriver&) = delete;

  /// Every sample of the robot, in order.
  virtual void receive(const Sample& /*sample*/) {}
  /// The command for now; `done` when the lap is over.
  [[nodiscard]] virtual Result<DriverDecision> drive(Duration uptime, SensorTime now) = 0;
  /// How to drive, in one line; empty when nobody has to know.
  [[nodiscard]] virtual std::string usage() const { return {}; }

 protected:
  LapDriver() = default;
};

/// A person at a robot whose time does not pass by itself: before each decision it waits until this
/// computer's clock is as far as the robot's.
class PacedDriver final : public LapDriver {
 public:
  /// `clock` never goes back; `wait` returns after the duration has passed on it.
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

/// Paced by the steady clock.
[[nodiscard]] std::unique_ptr<LapDriver> in_real_time(std::unique_ptr<LapDriver> driver);

/// What the operator asks for at this moment.
struct OperatorRequest {
  std::vector<OperatorEvent> events{};
  VelocityCommand command{};          ///< of sticks or keys, whatever the state makes of it
  std::optional<GamepadState> pad{};  ///< a sample like any other
  std::vector<std::string> words{};   ///< for the operator: what was not understood
  std::optional<GivenPose> pose{};    ///< of SessionRequest
};

/// Where the operator's buttons and sticks are: a gamepad, a keyboard, lines of a program, a page, a script.
class OperatorInput {
 public:
  virtual ~OperatorInput() = default;
  OperatorInput(const OperatorInput&) = delete;
  OperatorInput& operator=(const OperatorInput&) = delete;

  /// Asked twenty times a second; never waits. An error ends the session.
  [[nodiscard]] virtual Result<OperatorRequest> read(Duration uptime, SensorTime now,
                                                     OperatorState state) = 0;
  /// Every sample of the robot: a script follows the truth.
  virtual void receive(const Sample& /*sample*/) {}
  /// How to use it, in one line.
  [[nodiscard]] virtual std::string usage() const = 0;
  /// What its buttons are called.
  [[nodiscard]] virtual OperatorButtons buttons(OperatorState /*state*/) const { return {}; }
  /// Whether a person uses it, who sees the robot.
  [[nodiscard]] virtual bool is_person() const { return true; }
  /// Whether the keys of the page drive while teaching.
  [[nodiscard]] virtual bool page_drives() const { return false; }
  /// Whether a script could drive the lap now.
  [[nodiscard]] virtual bool has_script() const { return false; }

 protected:
  OperatorInput() = default;
};

/// A script at the buttons: it teaches one lap, lets the robot repeat it once, and ends the session.
class ScriptInput final : public OperatorInput {
 public:
  /// `stays`: it does not end the session, because viewers may go on.
  ScriptInput(std::unique_ptr<LapDriver> driver, bool stays) : driver_(std::move(driver)), stays_(stays) {}

  Result<OperatorRequest> read(Duration uptime, SensorTime now, OperatorState state) override;
  void receive(const Sample& sample) override { driver_->receive(sample); }
  [[nodiscard]] std::string usage() const override {
    return "a script drives the world's line and presses the button";
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
