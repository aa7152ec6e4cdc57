#pragma once

#include <algorithm>
#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"

/// Tags of a scene whose observations contradict their given size.
namespace waymark {

/// The number of observations of a tag, by their use.
struct SizeObservations {
  int used = 0;
  int rejected = 0;
  int unconfirmed =
      0;  ///< and not used; with a wrong size, only those at similar distances confirm each other

  [[nodiscard]] double share_unused() const {
    return (rejected + unconfirmed) / std::max(1.0, 1.0 * used + rejected + unconfirmed);
  }
  /// Whether so many are not used that the tag itself is the cause.
  [[nodiscard]] bool contradict() const;
};

/// For each size of the problem.
[[nodiscard]] std::vector<SizeObservations> observations_by_size(const SceneMap& map);

/// Whether these are at most a quarter of the observed tags, or three. If more contradict the map, the tags
/// are not the cause.
[[nodiscard]] bool are_few_tags(std::size_t tags, const SceneMap& map);

/// The sizes whose observations contradict them, those with the largest share of unused ones first. Empty
/// unless these are few tags.
[[nodiscard]] std::vector<std::size_t> contradicted_sizes(const SceneMap& map);

/// Estimates the size and the pose of a tag from frames whose poses other tags determine. The tag's distance
/// in each frame is proportional to its size, and all distances must lead to one place. Changes nothing if
/// there are fewer than four such frames, if the size is more than twice or less than half the given one, or
/// if most frames disagree.
void start_size(SceneMap& map, std::size_t size);

}  // namespace waymark
