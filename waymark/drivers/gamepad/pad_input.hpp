#pragma once

#include <memory>
#include <string>

#include "waymark/drivers/gamepad/gamepad.hpp"
#include "waymark/drivers/gamepad/stick_driver.hpp"
#include "waymark/runtime/lap_driver.hpp"
#include "waymark/runtime/operator_input.hpp"

namespace waymark {

/// A person who drives a lap with a gamepad.
class PadLapDriver final : public LapDriver {
 public:
  PadLapDriver(std::unique_ptr<Gamepad> pad, double speed_m_s)
      : pad_(std::move(pad)), driver_({.speed_m_s = speed_m_s}) {}

  Result<DriverDecision> drive(Duration uptime, SensorTime now) override;
  [[nodiscard]] std::string usage() const override {
    return "hold the left shoulder; left stick speed, right stick turn, Y (triangle) ends the lap";
  }

 private:
  std::unique_ptr<Gamepad> pad_;
  StickDriver driver_;
};

/// An operator with a gamepad.
class PadInput final : public OperatorInput {
 public:
  PadInput(std::unique_ptr<Gamepad> pad, double speed_m_s)
      : pad_(std::move(pad)), driver_({.speed_m_s = speed_m_s, .finish_button = kNoButton}) {}

  Result<OperatorRequest> read(Duration uptime, SensorTime now, OperatorState state) override;
  [[nodiscard]] std::string usage() const override {
    return "Y (triangle) goes on, B (circle) stops, back ends; teaching: hold the left shoulder, sticks "
           "drive";
  }

 private:
  static constexpr int kNoButton = 31;
  std::unique_ptr<Gamepad> pad_;
  StickDriver driver_;
  OperatorPad events_{};
};

}  // namespace waymark
