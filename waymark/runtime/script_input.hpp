#pragma once

#include <memory>

#include "waymark/runtime/lap_driver.hpp"
#include "waymark/runtime/operator_input.hpp"

namespace waymark {

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
