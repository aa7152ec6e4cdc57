#pragma once

#include <memory>
#include <string>

#include "waymark/drivers/simulated/simulated_lap.hpp"

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
  /// Fails without pictures.
  [[nodiscard]] Status check(const SimulatedSetup& setup) const;
  /// Is the robot, until Ctrl-C.
  [[nodiscard]] Status run(const SimulatedSetup& setup, const SE2& start,
                           std::unique_ptr<DetectingCamera> scene_camera) const;

  std::string profile{};
};

}  // namespace waymark::cli
