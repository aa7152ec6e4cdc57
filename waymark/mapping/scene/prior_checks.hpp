#pragma once

#include <map>

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Tags whose prior alone determines their place in the map, with the number of their observations in use.
/// Neither these observations, nor motion, nor given distances connect them to another tag or to a camera
/// with a given pose. Empty if the map has a single observed tag.
[[nodiscard]] std::map<TagId, int> tags_on_prior_alone(const SceneMap& map);

/// A given pose that the observations contradict.
struct PriorContradiction {
  SE3 given_T_found{};  ///< the pose according to the observations alone, without the given one
  double sigmas = 0;    ///< of the difference
};

/// Compares a given pose with the other information on it, at a chance of one in a thousand. The estimate
/// lies between the two, so the difference is divided by the share of the given pose in the estimate. In
/// units of the prior, the estimate's residual r has the covariance I - V, with V the estimate's covariance.
/// `covariance`: of the estimate, in the left tangent.
[[nodiscard]] std::optional<PriorContradiction> contradiction(const PosePriorFactor& given,
                                                              const SE3& estimate, const Matrix6& covariance);

/// The sizes of tags whose estimated pose is far from the given one.
[[nodiscard]] std::vector<std::size_t> sizes_far_from_given_pose(const SceneMap& map);

}  // namespace waymark
