#pragma once

#include "waymark/mapping/scene/id_places.hpp"
#include "waymark/mapping/solver/tag_moves.hpp"

/// Places of an id that were in view without a tag. A tag that was observed somewhere else meanwhile was
/// moved.
namespace waymark {

/// Whether one of two places was in view while the tag was observed at the other one, so often that a tag
/// there would have been observed. The evidence is that of missing_tags(): views close to viewpoints from
/// which the tag was observed there, with one unit of evidence per pass. Walls between the places have no
/// effect. O(observations).
[[nodiscard]] bool was_vacated(const SceneMap& map, const ObservationTimes& times, const IdPlaces& id,
                               const IdPlace& first, const IdPlace& second);

}  // namespace waymark
