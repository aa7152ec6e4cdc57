#pragma once

#include <memory>

#include "waymark/app/robot/plant.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

/// A robot of the simulator, with a renderer behind its cameras where the setup has pictures. Fails where
/// they cannot be made.
[[nodiscard]] Result<std::unique_ptr<Plant>> make_simulated_plant(const SimulatedSetup& setup,
                                                                  const SE2& map_T_base);

}  // namespace waymark
