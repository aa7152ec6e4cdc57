#pragma once

#include <functional>
#include <memory>
#include <string>

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

}  // namespace waymark
