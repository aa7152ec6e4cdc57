#pragma once

#include <memory>
#include <string>
#include <vector>

#include "waymark/live/plant.hpp"
#include "waymark/live/robot_setup.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

class Console;

/// The flag --plant of a simulated robot whose physics and sensors are another program's; of an app that has
/// --ros2, --limo, --mbot and --gazebo.
class PlantFlags {
 public:
  explicit PlantFlags(CLI::App& app);
  PlantFlags(const PlantFlags&) = delete;
  PlantFlags& operator=(const PlantFlags&) = delete;

  [[nodiscard]] bool chosen() const { return !given_.empty(); }
  /// Empty where it was not given.
  [[nodiscard]] RobotCommand process() const;
  /// Starts it; without the flag a robot of the simulator where the world's line begins. Fails when it does
  /// not send these types of lines; its words go to the console.
  [[nodiscard]] Result<std::unique_ptr<Plant>> make(const RobotSetup& setup,
                                                    const std::vector<std::string>& sends,
                                                    Console& console) const;

 private:
  std::string given_{};
};

}  // namespace waymark::cli
