#pragma once

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Makes the numbers of every camera of a scene unknowns, with priors about what is given: focal lengths
/// within 1 %, the principal point within 1 % of the image's width, k within 0.05, p within 0.005 (standard
/// deviations).
void free_intrinsics(SceneMap& map);

/// What became of them, once the covariance is known; the cameras of the scene are then as found.
void report_intrinsics(SceneMap& map);

}  // namespace waymark
