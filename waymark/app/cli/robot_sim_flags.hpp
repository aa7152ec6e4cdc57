#pragma once

#include <string>

#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/app/robot/robot_sim.hpp"

namespace waymark::cli {

/// Whether the flag --plant, which selects another program as the simulation, is offered.
enum class PlantFlag : std::uint8_t { Shown, None };

/// Flags for a simulated robot with any protocol: --config, --set, those for its setup, --images, --faults,
/// --plant. Must not move while the command line is parsed.
class RobotSimFlags {
 public:
  explicit RobotSimFlags(CLI::App& verb, PlantFlag plant = PlantFlag::Shown,
                         Images images = Images::OnDemand);
  RobotSimFlags(const RobotSimFlags&) = delete;
  RobotSimFlags& operator=(const RobotSimFlags&) = delete;

  /// Runs the robot on its wire until Ctrl-C or the end of its input. An error in the wire options is a usage
  /// error.
  [[nodiscard]] ExitCode run(const Result<SimWire>& wire, Console& console) const;

 private:
  Settings settings_;
  SetupFlags setup_;
  ImageFlags images_;
  std::string plant_{};
};

}  // namespace waymark::cli
