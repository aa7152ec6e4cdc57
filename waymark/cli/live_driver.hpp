#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "waymark/cli/human_driver.hpp"
#include "waymark/drivers/simulated/simulated_lap.hpp"
#include "waymark/simulation/scripted_driver.hpp"

namespace waymark::cli {

/// Who drives a robot that lives: a person, or a script that is told where the robot truly is.
class LiveDriver {
 public:
  /// `name` as --driver takes it. Fails without a terminal, without a pad, without a line to drive.
  static Result<std::unique_ptr<LiveDriver>> make(const std::string& name, double speed_m_s,
                                                  const SimulatedStage& stage);

  /// The script looks at the truth alone.
  void hear(const Sample& sample);
  [[nodiscard]] Result<DriverDecision> drive(Duration uptime, SensorTime now);
  [[nodiscard]] std::string usage() const { return human_ ? human_->usage() : std::string(); }

 private:
  LiveDriver() = default;
  std::unique_ptr<HumanDriver> human_{};
  std::optional<ScriptedDriver> script_{};
  std::optional<SE2> map_T_base_{};
};

}  // namespace waymark::cli
