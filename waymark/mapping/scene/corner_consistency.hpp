#pragma once

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// The sum of squared residuals of corners over their own covariances as the detector gave them, by degree of
/// freedom, of views in use with at least two tags in use: about 1 when those covariances are true and errors
/// of tags are independent. 0 where there is no such view, or no covariance was given.
[[nodiscard]] double corner_chi2_per_dof(const SceneMap& map);

}  // namespace waymark
