#pragma once

#include <functional>
#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

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
