#pragma once

#include <functional>
#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Makes the numbers of cameras unknowns, with priors about what is given: within the standard deviations
/// that the scene has of a camera; with `all` those of every other camera too, focal lengths within 1 %, the
/// principal point within 1 % of the image's width, k within 0.05, p within 0.005.
void free_intrinsics(SceneMap& map, bool all);

/// What became of them, once the covariance is known; the cameras of the scene are then as found.
void report_intrinsics(SceneMap& map);

/// The size of all tags, as a multiple of what is given.
struct TagScale {
  double value = 1, sigma = 0;
  std::vector<Vector6> by_scale{};  ///< d(left tangent of each pose) / d(value), at the optimum
};

/// Finds one factor for the sizes of all tags, known beforehand within `prior_sigma` of 1, from distances and
/// priors of several tags: the minimum of the parabola through what three of them cost. `adjust` finds the
/// least cost at a size. The poses stand at the optimum afterwards.
[[nodiscard]] TagScale find_tag_scale(SceneMap& map, double start, double prior_sigma,
                                      const std::function<void()>& adjust);

}  // namespace waymark
