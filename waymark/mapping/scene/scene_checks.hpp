#pragma once

#include <string>
#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// What to say of a scene's map, a sentence each: given facts that the rest contradicts, with the residual in
/// standard deviations; tags most of whose observations contradict the rest, known ones first; tags that rest
/// on what was given alone; parts that hang on a few observations, and those that were left out for it; tags
/// whose place nothing determines.
[[nodiscard]] std::vector<std::string> scene_doubts(const SceneMap& map);

}  // namespace waymark
