#pragma once

#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// The tags on static bodies that were taken away or hidden (see missing_tags()). `map`: with its covariance
/// and moved tags. Tags that were observed at one place after the other are in SceneMap::duplicate_tags.
[[nodiscard]] std::vector<MissingTag> missing_scene_tags(const SceneRecording& recording,
                                                         const SceneMap& map);

}  // namespace waymark
