#pragma once

#include <functional>
#include <vector>

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

/// The size of all tags as a multiple of their given sizes.
struct TagScale {
  double value = 1, sigma = 0;
  std::vector<Vector6> by_scale{};  ///< d(left tangent of each pose) / d(value) at the optimum
};

/// Estimates a common factor for the sizes of all tags, with a prior of 1 +- `prior_sigma`, from distances
/// and from priors on several tags. The estimate is the minimum of a parabola through the cost at three
/// factors. `adjust` minimises the cost at a given size. Afterwards, the poses are at the optimum.
[[nodiscard]] TagScale find_tag_scale(SceneMap& map, double start, double prior_sigma,
                                      const std::function<void()>& adjust);

}  // namespace waymark
