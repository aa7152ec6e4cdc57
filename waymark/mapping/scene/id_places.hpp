#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"

/// The places at which one id was observed.
namespace waymark {

inline constexpr std::ptrdiff_t kMinTermsOfTag = 4;  ///< a smaller number is attributed to misread ids
inline constexpr std::size_t kMaxPlaces = 4;         ///< an id at more places is that of a moving tag

/// Observations of an id at one place. In the bundle, each place has its own pose and its own size.
struct IdPlace {
  PoseIndex pose = 0;
  std::size_t size = 0;              ///< index into Bundle::sizes
  std::vector<std::size_t> terms{};  ///< indices into Bundle::corners, ascending
  std::optional<SE3> start{};        ///< initial value of the pose, if there is one
};

/// The places of the id of TagScene::bodies[body].tags[tag]. The map contains the first one. It is that
/// nearest to the given or fixed pose or, if there is none, that with the most observations. If one was
/// observed after the other, one tag may have been moved, so the map contains the later place.
struct IdPlaces {
  std::size_t body = 0, tag = 0;
  std::vector<std::size_t> terms{};  ///< all observations of the id, ascending
  std::vector<IdPlace> places{};
};

/// The ids whose observations form at least two groups of `least` observations that do not confirm each
/// other, with one place per group, the largest first. A tag that was out of view for a while may have
/// several groups, too. `groups`: Confirmation::groups of the observations. O(observations).
[[nodiscard]] std::vector<IdPlaces> ids_in_groups(const SceneMap& map, const std::vector<std::size_t>& groups,
                                                  std::size_t least);

/// The places of the tag with this size, by the frames that other tags determine. Each of them has at least
/// kMinTermsOfTag observations that agree on it. Empty unless there are two to kMaxPlaces. O(all
/// observations).
[[nodiscard]] std::optional<IdPlaces> places_of_size(const SceneMap& map, std::size_t size);

/// Gives each place its pose and its size. The first place keeps those of the tag, and what is given about
/// the tag. Other observations of the id go to the place that was observed nearest in time.
void separate_places(SceneMap& map, IdPlaces& id);

/// Joins places whose poses are nearly the same, except for the first `kept` ones, those without a placed
/// pose, and those that were observed together.
void join_near_places(SceneMap& map, std::size_t kept, IdPlaces& id);

/// The first place becomes the one that the map is to contain (see IdPlaces).
void choose_place_of_map(const SceneMap& map, IdPlaces& id);

/// Adds the observations of a place to the first one, and removes it. Its pose remains, without observations.
void join_with_first(Bundle& bundle, std::size_t place, IdPlaces& id);

/// Assigns each observation of the id to the placed pose that it fits best. Returns whether any has changed.
bool assign_to_places(SceneMap& map, IdPlaces& id);

/// The frames with observations in use of a place, ascending, each of them once.
[[nodiscard]] std::vector<std::size_t> frames_of(const SceneMap& map, const IdPlace& place);

/// Whether there are at least two frames in which both places were observed. Such places are not those of one
/// tag.
[[nodiscard]] bool are_observed_at_once(const SceneMap& map, const IdPlace& a, const IdPlace& b);

/// Whether a point in time separates the frames, except for less than a fifth of them. `first`, `second`:
/// ascending.
[[nodiscard]] bool are_apart_in_time(const std::vector<std::size_t>& first,
                                     const std::vector<std::size_t>& second);

/// Whether the median of the first frames is earlier than that of the second ones. Neither is empty.
[[nodiscard]] bool is_earlier(const std::vector<std::size_t>& first, const std::vector<std::size_t>& second);

/// Whether the poses differ clearly, even if their accuracy is that before the first adjustment.
[[nodiscard]] bool are_clearly_apart(const SE3& a, const SE3& b);

}  // namespace waymark
