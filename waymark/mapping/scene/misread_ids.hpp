#pragma once

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Gives observations that are far from where their tag is the id of another tag of the body, where the
/// corners are about where that one is (chi-square below four times `outlier_chi2`, in any of the four orders
/// of the corners) and where no other tag that was seen about that time is anywhere near; the view must show
/// something that agrees with the map, and not that tag already. They count from then on and are added to
/// SceneMap::corrected_ids. How many there are. Corner noise must be isotropic. O(observations).
int correct_misread_ids(SceneMap& map, double outlier_chi2);

}  // namespace waymark
