#pragma once

#include <cstddef>
#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/mapping/solver/tag_sizes.hpp"

/// Tags of a scene whose observations contradict their given size.
namespace waymark {

/// For each size of the problem.
[[nodiscard]] std::vector<SizeObservations> observations_by_size(const SceneMap& map);

/// The sizes whose observations contradict them, those with the largest share of unused ones first. Empty
/// unless these are few tags.
[[nodiscard]] std::vector<std::size_t> contradicted_sizes(const SceneMap& map);

/// Estimates the size and the pose of a tag from frames whose poses other tags determine. The tag's distance
/// in each frame is proportional to its size, and all distances must lead to one place. Changes nothing if
/// there are fewer than four such frames, if the size is more than twice or less than half the given one, or
/// if most frames disagree.
void start_size(SceneMap& map, std::size_t size);

}  // namespace waymark
