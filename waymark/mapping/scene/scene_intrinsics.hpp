#pragma once

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Makes the numbers of cameras unknowns, with priors about what is given: within the standard deviations
/// that the scene has of a camera; with `all` those of every other camera too, focal lengths within 1 %, the
/// principal point within 1 % of the image's width, k within 0.05, p within 0.005.
void free_intrinsics(SceneMap& map, bool all);

/// What became of them, once the covariance is known; the cameras of the scene are then as found.
void report_intrinsics(SceneMap& map);

}  // namespace waymark
