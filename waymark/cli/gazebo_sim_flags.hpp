#pragma once

#include <string>

#include "waymark/drivers/simulated/simulated_lap.hpp"
#include "waymark/live/plant.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// The flag --gazebo of a simulated robot that stands in for one in Gazebo; of an app that has --limo and
/// --mbot.
struct GazeboSimFlags {
  explicit GazeboSimFlags(CLI::App& app);
  GazeboSimFlags(const GazeboSimFlags&) = delete;
  GazeboSimFlags& operator=(const GazeboSimFlags&) = delete;

  [[nodiscard]] bool chosen() const { return !profile.empty(); }
  /// Fails without pictures. Gazebo's diff drive goes on with the last command for ever.
  [[nodiscard]] Status apply(SimulatedSetup& setup) const;
  /// Is the robot, until Ctrl-C.
  [[nodiscard]] Status run(Plant& plant, const CameraModel& camera) const;

  std::string profile{};
};

}  // namespace waymark::cli
