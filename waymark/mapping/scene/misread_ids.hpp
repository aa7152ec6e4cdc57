#pragma once

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Corrects misread ids. An observation that is far from its tag is assigned to another tag on the body and
/// added to SceneMap::corrected_ids if all of these conditions hold:
/// - the corners fit that tag (chi-square below four times `outlier_chi2`, in any of the four orders of the
/// corners);
/// - no other tag observed at about that time is anywhere near it;
/// - the view contains an observation that is consistent with the map, and does not contain that tag already.
/// Corrected observations are used. Returns their number. Corner noise must be isotropic. O(observations).
int correct_misread_ids(SceneMap& map, double outlier_chi2);

}  // namespace waymark
