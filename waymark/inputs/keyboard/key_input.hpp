#pragma once

#include <memory>
#include <string>

#include "waymark/inputs/keyboard/key_driver.hpp"
#include "waymark/inputs/keyboard/terminal_keys.hpp"
#include "waymark/runtime/operator_input.hpp"

namespace waymark {

/// A person who drives a lap with the keys of a terminal.
class KeyLapDriver final : public LapDriver {
 public:
  KeyLapDriver(std::unique_ptr<TerminalKeys> keys, double speed_m_s)
      : keys_(std::move(keys)), driver_({.speed_m_s = speed_m_s}) {}

  Result<DriverDecision> drive(Duration uptime, SensorTime now) override;
  [[nodiscard]] std::string usage() const override {
    return "w a s d or arrows drive while they are held, space stops, q ends the lap";
  }

 private:
  std::unique_ptr<TerminalKeys> keys_;
  KeyDriver driver_;
  std::string bytes_{};
};

/// An operator at the keys of a terminal.
class KeyInput final : public OperatorInput {
 public:
  KeyInput(std::unique_ptr<TerminalKeys> keys, double speed_m_s)
      : keys_(std::move(keys)), driver_({.speed_m_s = speed_m_s}) {}

  Result<OperatorRequest> read(Duration uptime, SensorTime now, OperatorState state) override;
  [[nodiscard]] std::string usage() const override {
    return "y goes on, b or space stops, q ends; teaching: w a s d or arrows drive while they are held";
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
