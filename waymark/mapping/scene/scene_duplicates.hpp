#pragma once

#include <vector>

#include "waymark/mapping/scene/scene_search.hpp"
#include "waymark/mapping/scene/tag_identity.hpp"

/// Duplicate tags are separated before the fine search, because otherwise the parts of the map around them
/// overlap.
namespace waymark::internal {

/// The ids whose observations may show duplicate tags, with their places. Gives each group of observations
/// that confirm each other a pose and places all poses. Leaves the bundle as it was.
///
/// Wrong odometry or drift displaces all tags that are observed again. Ids at several places that were never
/// observed at once count as that if they are more than three, and more than the ids found again at one
/// place. None of them is then in the result.
[[nodiscard]] std::vector<IdPlaces> ids_at_several_places(SceneSearch& search);

/// Searches again with a pose for each place of these ids. Keeps the result if it explains the observations
/// better; `start`, the bundle before the search, then has these poses, too. Returns the ids of duplicate
/// tags. Ids that prove to be those of one tag keep one pose. Costs one search and another one per id that is
/// not proven to be a duplicate.
[[nodiscard]] std::vector<IdPlaces> separate_duplicates(SceneSearch& search, std::vector<IdPlaces> ids,
                                                        Bundle& start);

/// Gives each id one pose again, that of its first place.
void join_places(const std::vector<IdPlaces>& ids, Bundle& bundle);

/// The cost of the duplicate tags as an explanation, comparable with cost_of_explanation(): three quarters of
/// what rejecting the observations of each second tag costs there. Thus, one duplicate tag is more likely
/// than wrong odometry, and several ones are less likely.
[[nodiscard]] double cost_of_duplicates(const SceneMap& map, const std::vector<IdPlaces>& duplicates,
                                        double outlier_chi2);

/// Joins the places that a finer search shows to be those of one tag, and adjusts the map again if there are
/// any. Costs one covariance() if there are duplicates.
void join_unproven(SceneSearch& search, std::vector<IdPlaces>& duplicates);

/// Lists them as SceneMap::duplicate_tags, except for places without accepted observations.
void list_duplicates(const std::vector<IdPlaces>& duplicates, SceneMap& map);

}  // namespace waymark::internal
