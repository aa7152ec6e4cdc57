#pragma once

#include "waymark/geometry/se2.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/simulation/world.hpp"

namespace waymark {

/// From the hull to the nearest wall or piece of furniture that is as low as the hull is high, seen from
/// above [m]; 0 when they touch, infinite in an empty world. What hangs higher (tags on walls) is not met.
/// O(walls + occluders).
[[nodiscard]] double obstacle_distance_m(const World& world, const Hull& hull, const SE2& map_T_base);

}  // namespace waymark
