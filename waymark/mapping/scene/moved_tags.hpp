#pragma once

#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/mapping/solver/tag_moves.hpp"

/// Tags of a scene that were moved during a recording. The map contains their last pose.
namespace waymark {

/// The times of the observations in a scene.
[[nodiscard]] ObservationTimes times_of(const SceneRecording& recording,
                                        const SceneObservations& observations);

/// Gives the observations before a move a pose of their own (see tag_moves.hpp).
SeparatedTag separate_earlier(SceneMap& map, const ObservationTimes& times, const LikelyMove& move);

/// The move of a tag that has a pose before and one after it.
[[nodiscard]] MovedTag describe_move(const SceneMap& map, const ObservationTimes& times,
                                     const SeparatedTag& separated);

/// The move of a tag; nullptr if it was not moved.
[[nodiscard]] const MovedTag* find_moved(const SceneMap& map, const TagId& tag);

}  // namespace waymark
