#pragma once

#include <memory>
#include <optional>
#include <string>

#include "waymark/robots/simulated/simulated_lap.hpp"
#include "waymark/runtime/operator_input.hpp"

namespace waymark {

/// A script that drives the world's line: it follows the truth that a robot sends, or, where somebody shows
/// it the robot, what it sees.
class ScriptDriver final : public LapDriver {
 public:
  /// Fails on a world without a line.
  static Result<std::unique_ptr<LapDriver>> make(const SimulatedSetup& setup, double speed_m_s);
  explicit ScriptDriver(ScriptedDriver script) : script_(std::move(script)) {}

  void receive(const Sample& sample) override;
  /// Fails after five seconds without the truth.
  Result<DriverDecision> drive(Duration uptime, SensorTime now) override;
  /// Where the robot truly is now. From then on its time is the robot's uptime, and the truth that is sent
  /// does not count.
  void see(const SE2& map_T_base);

 private:
  ScriptedDriver script_;
  bool sees_ = false;
  std::optional<SE2> map_T_base_{};
};

}  // namespace waymark
