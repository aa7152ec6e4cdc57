#pragma once

#include <memory>
#include <optional>
#include <string>

#include "waymark/drivers/simulated/simulated_lap.hpp"
#include "waymark/runtime/lap_driver.hpp"

namespace waymark {

/// A script that drives the world's line: it follows the truth that a robot sends.
class ScriptDriver final : public LapDriver {
 public:
  /// Fails on a world without a line.
  static Result<std::unique_ptr<LapDriver>> make(const SimulatedStage& stage, double speed_m_s);

  void hear(const Sample& sample) override;
  /// Fails after five seconds without the truth.
  Result<DriverDecision> drive(Duration uptime, SensorTime now) override;

 private:
  explicit ScriptDriver(ScriptedDriver script) : script_(std::move(script)) {}
  ScriptedDriver script_;
  std::optional<SE2> map_T_base_{};
};

}  // namespace waymark
