#pragma once

#include <map>
#include <optional>
#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Tags whose prior alone determines their place in the map, with the number of their observations in use.
/// Neither these observations, nor motion, nor given distances connect them to another tag or to a camera
/// with a given pose. Empty if the map has a single observed tag.
[[nodiscard]] std::map<TagId, int> tags_on_prior_alone(const SceneMap& map);

/// By how many standard deviations the observations contradict a given pose; empty if they do so by chance
/// once in a thousand times or more often. The estimate lies between the given pose and what the observations
/// alone would give. In units of the prior, the estimate's residual r has the covariance I - V, with V the
/// estimate's covariance. If the estimate does not use the given pose, it is I + V. `covariance`: of the
/// estimate, in the left tangent.
[[nodiscard]] std::optional<double> contradiction_sigmas(const PosePriorFactor& given, const SE3& estimate,
                                                         const Matrix6& covariance, bool used = true);

/// The sizes of tags whose estimated pose is far from the given one, the farthest first. A map
/// that yields to a wrong given pose contradicts right ones too, but less.
[[nodiscard]] std::vector<std::size_t> sizes_far_from_given_pose(const SceneMap& map);

}  // namespace waymark
