#pragma once

#include <vector>

#include "waymark/mapping/scene/scene_search.hpp"
#include "waymark/mapping/scene/tag_identity.hpp"
#include "waymark/mapping/solver/tag_moves.hpp"

namespace waymark::internal {

/// Estimates the spread of printed sizes, and finds the tags that contradict the map. They have another size
/// than given or a wrong given pose, they were moved, or two tags have their id. Adds to `duplicates`, and
/// returns the moved tags. Nothing is searched if sizes are exact.
[[nodiscard]] std::vector<SeparatedTag> explain_contradictions(SceneSearch& search,
                                                               std::vector<IdPlaces>& duplicates);

}  // namespace waymark::internal
