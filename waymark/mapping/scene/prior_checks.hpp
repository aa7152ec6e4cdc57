#pragma once

#include <map>

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Tags whose prior alone determines their place in the map, with the number of their observations in use.
/// Neither these observations, nor motion, nor given distances connect them to another tag or to a camera
/// with a given pose. Empty if the map has a single observed tag.
[[nodiscard]] std::map<TagId, int> tags_on_prior_alone(const SceneMap& map);

}  // namespace waymark
