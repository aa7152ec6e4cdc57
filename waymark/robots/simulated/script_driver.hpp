#pragma once

#include <memory>
#include <optional>
#include <string>

#include "waymark/robots/simulated/simulated_lap.hpp"
#include "waymark/runtime/operator_input.hpp"

namespace waymark {

/// A scripted driver that follows the world's line using ground truth: either truth samples from the robot or
/// poses passed to see().
class ScriptDriver final : public LapDriver {
 public:
  /// Fails if the world has no line.
  static Result<std::unique_ptr<LapDriver>> make(const SimulatedSetup& setup, double speed_m_s);
  explicit ScriptDriver(ScriptedDriver script) : script_(std::move(script)) {}

  void receive(const Sample& sample) override;
  /// Fails after five seconds without ground truth.
  Result<DriverDecision> drive(Duration uptime, SensorTime now) override;
  /// Sets the current true pose. From then on, the driver's time is the robot's uptime, and truth samples are
  /// ignored.
  void see(const SE2& map_T_base);

 private:
  ScriptedDriver script_;
  bool tracked_ = false;
  std::optional<SE2> map_T_base_{};
};

}  // namespace waymark
