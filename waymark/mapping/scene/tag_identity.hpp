#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/mapping/scene/id_places.hpp"
#include "waymark/mapping/solver/tag_moves.hpp"

/// Whether the places of one id are those of one tag or of duplicate tags.
namespace waymark {

enum class TagIdentity : std::uint8_t {
  OneTag,    ///< the places are the same within their uncertainty, or one of them is not a place of a tag
  MovedTag,  ///< one tag was moved, perhaps several times
  TwoTags,   ///< proven if they were observed at once; otherwise, the more likely cause
};

/// The identity of a place and the first one. They are one tag if two prints there would overlap. Places that
/// were observed at once are two tags. Otherwise, one tag was moved if one place was in view without it (see
/// was_vacated()). It was moved, too, if the places were observed one after the other and are less than
/// kMaxMoved_m apart. `separation_chi2`: see separations_of(). Costs O(observations), and a search for
/// missing tags if the places were not observed at once.
[[nodiscard]] TagIdentity identity_of(const SceneMap& map, const ObservationTimes& times, const IdPlaces& id,
                                      std::size_t place, double separation_chi2);

/// For each place of each id, the squared distance of its pose from the first place's, with the covariance of
/// the difference (chi-square with 6 degrees of freedom). It is 0 for the first place and for those not
/// placed. Costs one covariance().
[[nodiscard]] std::vector<std::vector<double>> separations_of(const SceneMap& map,
                                                              const std::vector<IdPlaces>& ids);

/// Whether the place may be that of a second tag: it was observed at once with the first one, or its pose is
/// clearly another one. It is not if the tag may have been moved there. A coarse test for poses of low
/// accuracy.
[[nodiscard]] bool may_be_second_tag(const SceneMap& map, const IdPlaces& id, std::size_t place);

/// Whether a place of the id was observed at once with the first one, which proves that there are two tags.
[[nodiscard]] bool are_proven_two(const SceneMap& map, const IdPlaces& id);

/// The tag at a place of an id that is not in the map.
[[nodiscard]] DuplicateTag describe_duplicate(const SceneMap& map, const IdPlaces& id, std::size_t place);

}  // namespace waymark
