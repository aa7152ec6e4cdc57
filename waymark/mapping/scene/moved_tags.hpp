#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"

/// Tags that were moved during a recording. The map contains their last pose.
namespace waymark {

/// A time without an observation of a tag, in which it may have been moved.
struct LikelyMove {
  std::size_t size = 0;                          ///< of the tag, an index into Bundle::sizes
  std::size_t last_before = 0, first_after = 0;  ///< frames
  double gap_s = 0;                              ///< between these frames
  double gain = 0;  ///< how much less the squared residuals are with two poses, to first order
};

/// For each tag with a size in `sizes`, the move that explains its observations best, with all other poses
/// held constant. A move takes half a second, and has at least four observations before and after it. Tags
/// for which a second pose does not explain enough are left out (Schwarz, "Estimating the Dimension of a
/// Model", Annals of Statistics 6(2), 1978). The best explained first. O(observations of these tags).
[[nodiscard]] std::vector<LikelyMove> likely_moves(const SceneRecording& recording, const SceneMap& map,
                                                   const std::vector<std::size_t>& sizes);

/// The moves of one tag that are worth trying: the two that could take longest, and the most likely one. The
/// most likely one is not always right, because images between two moves may follow the tag.
[[nodiscard]] std::vector<LikelyMove> moves_to_try(const SceneRecording& recording, const SceneMap& map,
                                                   std::size_t size);

/// At the time of a move, one move of each of the tags that were most often observed together with the moved
/// one. One of them may be the tag that was moved.
[[nodiscard]] std::vector<LikelyMove> moves_of_neighbours(const SceneRecording& recording,
                                                          const SceneMap& map, const LikelyMove& move);

/// A tag with a pose before and one after a move.
struct SeparatedTag {
  LikelyMove move{};
  PoseIndex earlier = 0, later = 0;
};

/// Gives the observations before a move a pose of their own, which is the last one of the bundle. What is
/// given about the tag (pose, distances, coordinates, directions) applies to this pose. Both poses start
/// where most of their observations agree.
SeparatedTag separate_earlier(SceneMap& map, const LikelyMove& move);

/// Undoes separate_earlier(). The earlier pose remains, without observations.
void join_again(SceneMap& map, const SeparatedTag& tag);

/// Applies distances, coordinates and directions of pose `from` to pose `to` of the same tag.
void move_given_facts(Bundle& bundle, PoseIndex from, PoseIndex to);

/// The distance and the angle between the two poses of a moved tag, and the time of the move.
[[nodiscard]] MovedTag describe_move(const SceneRecording& recording, const SceneMap& map,
                                     const SeparatedTag& tag);

/// The move of a tag; nullptr if it was not moved.
[[nodiscard]] const MovedTag* find_moved(const SceneMap& map, const TagId& tag);

}  // namespace waymark
