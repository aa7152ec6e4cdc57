#pragma once

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Makes camera parameters unknowns. The means of their priors are the given values, and the standard
/// deviations are those in the scene. `all`: also includes cameras without standard deviations in the scene.
/// The standard deviations are then 1 % for focal lengths, 1 % of the image width for the principal point,
/// 0.05 for k and 0.005 for p.
void free_intrinsics(SceneMap& map, bool all);

/// Fills in SceneMap::intrinsics once the covariance has been computed, and sets the cameras of the scene to
/// the estimates.
void report_intrinsics(SceneMap& map);

}  // namespace waymark
