#include "waymark/mapping/scene/scene_duplicates.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/mapping/scene/moved_tags.hpp"
#include "waymark/mapping/scene/odometry_checks.hpp"

namespace waymark::internal {
namespace {

/// The given pose of an id may be that of any of its places. Does not use it to place other poses, if the
/// pose of another tag or of a camera is known.
void release_given_poses(const Bundle& bundle, const std::vector<IdPlaces>& ids,
                         std::vector<KnownPose>& known) {
  std::vector<char> in_question(bundle.poses.size(), 0);
  for (const IdPlaces& id : ids) in_question[id.places.front().pose] = 1;
  const auto is_known = [&](PoseIndex pose) { return bundle.poses[pose].fixed || known[pose].placed; };
  const bool others = std::ranges::any_of(bundle.corners, [&](const CornerTerm& term) {
    return (is_known(term.tag) && in_question[term.tag] == 0) || (is_known(term.rig) && is_known(term.cam));
  });
  for (std::size_t i = 0; others && i < in_question.size(); ++i)
    known[i].placed = known[i].placed && in_question[i] == 0;
}

bool may_have_second_tag(const SceneMap& map, const IdPlaces& id) {
  for (std::size_t i = 1; i < id.places.size(); ++i) {
    if (may_be_second_tag(map, id, i)) return true;
  }
  return false;
}

/// Whether the id is at more places than those of duplicate tags, as a tag on a trolley.
bool moves_often(const SceneMap& map, const IdPlaces& id) {
  const auto placed =
      std::ranges::count_if(id.places, [&](const IdPlace& place) { return map.placed[place.pose] != 0; });
  return placed > static_cast<std::ptrdiff_t>(kMaxPlaces);
}

/// Drops ids that were never observed at two places at once, if there are too many of them to be duplicates.
void drop_displaced_tags(const SceneMap& map, std::ptrdiff_t found_again, std::vector<IdPlaces>& ids) {
  constexpr std::ptrdiff_t kAlwaysPossible = 3;
  const auto is_displaced = [&](const IdPlaces& id) { return !are_proven_two(map, id); };
  if (std::ranges::count_if(ids, is_displaced) > std::max(kAlwaysPossible, found_again))
    std::erase_if(ids, is_displaced);
}

/// Removes ids that move often. Only one of their places connects images.
void drop_moving_tags(SceneSearch& search, std::vector<IdPlaces>& ids) {
  const SceneMap& map = search.map();
  for (const IdPlaces& id : ids) {
    if (!moves_often(map, id)) continue;
    for (std::size_t i = 1; i < id.places.size(); ++i) search.leave_unconfirmed(id.places[i].terms);
  }
  std::erase_if(ids, [&](const IdPlaces& id) { return moves_often(map, id); });
}

}  // namespace

std::vector<IdPlaces> ids_at_several_places(SceneSearch& search) {
  SceneMap& map = search.map();
  const Confirmation& confirmation = search.confirmation();
  const auto least =
      static_cast<std::size_t>(std::max(kMinTermsOfTag, static_cast<std::ptrdiff_t>(confirmation.min_votes)));
  std::vector<IdPlaces> ids = ids_in_groups(map, confirmation.groups, least);
  if (ids.empty()) return ids;
  Bundle& bundle = map.problem.bundle;
  Bundle start = bundle;
  for (IdPlaces& id : ids) separate_places(map, id);
  search.place([&](std::vector<KnownPose>& known) { release_given_poses(bundle, ids, known); });
  std::ptrdiff_t found_again = 0;
  std::vector<IdPlaces> several;
  for (IdPlaces& id : ids) {
    join_near_places(map, 0, id);
    choose_place_of_map(map, id);
    found_again += id.places.size() == 1 ? 1 : 0;
    if (may_have_second_tag(map, id)) several.push_back(std::move(id));
  }
  drop_displaced_tags(map, found_again, several);
  drop_moving_tags(search, several);
  bundle = std::move(start);
  map.placed.clear();
  map.problem.moves.resize(bundle.poses.size());
  return several;
}

namespace {

/// How well the observations fit.
struct CornerResiduals {
  std::vector<double> px2{};   ///< squared residuals of each corner term
  std::vector<char> counts{};  ///< whether its poses are placed and it is not unconfirmed
  double others = 0;           ///< cost of all other terms, without the priors of sizes
  double noise_px = 0;
};

CornerResiduals corner_residuals(const SceneSearch& search) {
  Bundle& bundle = search.bundle();
  const double noise_px = search.noise_px();
  CornerResiduals residuals{.px2 = search.chi2_of_corners(), .noise_px = noise_px};
  std::vector<CornerTerm> corners;
  std::swap(corners, bundle.corners);
  residuals.others = cost(bundle);
  std::swap(corners, bundle.corners);
  for (std::size_t i = 0; i < bundle.corners.size(); ++i) {
    const CornerTerm& term = bundle.corners[i];
    residuals.px2[i] *= noise_px * noise_px;
    residuals.counts.push_back(search.map().is_placed(term) && !term.unconfirmed ? 1 : 0);
  }
  return residuals;
}

/// Whether these places explain the observations better than one place for each id, by the criterion of
/// Schwarz. Observations that only one of the maps places do not count.
bool explain_better(double outlier_chi2, const std::vector<IdPlaces>& ids, const CornerResiduals& separated,
                    const CornerResiduals& joined) {
  const double noise_px = std::min(joined.noise_px, separated.noise_px);
  const auto cost_of = [&](const CornerResiduals& residuals) {
    double sum = residuals.others;
    for (std::size_t i = 0; i < residuals.px2.size(); ++i) {
      if (joined.counts[i] != 0 && separated.counts[i] != 0)
        sum += std::min(residuals.px2[i] / (noise_px * noise_px), outlier_chi2) / 2;
    }
    return sum;
  };
  double more_unknowns = 0;
  for (const IdPlaces& id : ids) {
    const auto observations = static_cast<double>(id.terms.size());
    more_unknowns += 6 * static_cast<double>(id.places.size() - 1) / 2 * std::log(8 * observations);
  }
  return cost_of(separated) + more_unknowns < cost_of(joined);
}

/// Joins places that are those of one tag with the first one. Returns whether there is another tag.
bool join_places_of_first(SceneMap& map, const ObservationTimes& times,
                          const std::vector<double>& separations, IdPlaces& id) {
  bool two = false;
  for (std::size_t i = id.places.size(); i-- > 1;) {
    if (map.placed[id.places[i].pose] == 0) continue;
    if (identity_of(map, times, id, i, separations[i]) == TagIdentity::TwoTags)
      two = true;
    else
      join_with_first(map.problem.bundle, i, id);
  }
  return two;
}

/// Joins places that are those of one tag, and removes ids without a second tag. Returns whether there were
/// any; the observations of removed ids still have separate poses then.
bool join_places_of_one_tag(SceneSearch& search, const ObservationTimes& times, std::vector<IdPlaces>& ids) {
  SceneMap& map = search.map();
  bool assigned = false;
  for (IdPlaces& id : ids) assigned = assign_to_places(map, id) || assigned;
  if (assigned)
    search.find(search.options().search.robust_chi2, 10, "rejecting outliers", SceneSearch::kCoarseGain);
  if (!search.goes_on()) return false;
  const std::vector<std::vector<double>> separations = separations_of(map, ids);
  bool any = false;
  std::vector<IdPlaces> duplicates;
  for (std::size_t k = 0; k < ids.size(); ++k) {
    const std::size_t all = ids[k].places.size();
    const bool two = join_places_of_first(map, times, separations[k], ids[k]);
    // The poses of second places were not compared with each other.
    if (two) join_near_places(map, 1, ids[k]);
    any = any || !two || ids[k].places.size() != all;
    if (two) duplicates.push_back(std::move(ids[k]));
  }
  ids = std::move(duplicates);
  return any;
}

/// A search with a pose for each place of some ids.
class Separation {
 public:
  /// `start`: the bundle before the search, with one pose for each id.
  Separation(SceneSearch& search, const Bundle& start)
      : search_(search),
        start_(start),
        times_(times_of(search.recording(), search.map().observations)),
        joined_(search.state()),
        residuals_(corner_residuals(search)) {}

  /// Returns whether the places explain the observations better; if not, the map is as it was.
  bool find(std::vector<IdPlaces>& ids) {
    do {
      if (ids.empty()) break;
      search_from_start(ids);
    } while (search_.goes_on() && join_places_of_one_tag(search_, times_, ids));
    const bool better =
        !ids.empty() && search_.goes_on() &&
        explain_better(search_.options().search.outlier_chi2, ids, corner_residuals(search_), residuals_);
    if (!better) {
      search_.go_to(joined_);
      ids.clear();
    }
    return better;
  }

  /// Joins the places of each id that does not explain the observations better, so that no other duplicate
  /// decides about it.
  void check_one_by_one(std::vector<IdPlaces>& ids) {
    constexpr std::ptrdiff_t kMaxChecked = 5;  // limits the time
    const auto is_unproven = [&](const IdPlaces& id) { return !are_proven_two(search_.map(), id); };
    if (ids.size() < 2 || std::ranges::count_if(ids, is_unproven) > kMaxChecked) return;
    for (std::size_t k = ids.size(); k-- > 0 && ids.size() > 1 && search_.goes_on();) {
      if (is_unproven(ids[k])) check(k, ids);
    }
  }

 private:
  void search_from_start(std::vector<IdPlaces>& ids) {
    SceneMap& map = search_.map();
    map.problem.bundle = start_;
    map.placed.clear();
    map.problem.moves.resize(start_.poses.size());
    for (IdPlaces& id : ids) separate_places(map, id);
    search_.search_from_placed();
  }

  void check(std::size_t k, std::vector<IdPlaces>& ids) {
    SceneSearch::State with = search_.state();
    const CornerResiduals separated = corner_residuals(search_);
    const std::vector<IdPlaces> before = ids;
    const std::vector<IdPlaces> checked = {ids[k]};
    ids.erase(ids.begin() + static_cast<std::ptrdiff_t>(k));
    search_from_start(ids);
    const bool keeps = !search_.goes_on() || explain_better(search_.options().search.outlier_chi2, checked,
                                                            separated, corner_residuals(search_));
    if (!keeps) return;
    search_.go_to(std::move(with));
    ids = before;
  }

  SceneSearch& search_;
  const Bundle& start_;
  ObservationTimes times_;
  SceneSearch::State joined_;
  CornerResiduals residuals_;
};

}  // namespace

std::vector<IdPlaces> separate_duplicates(SceneSearch& search, std::vector<IdPlaces> ids, Bundle& start) {
  if (ids.empty() || !search.goes_on()) return {};
  SceneMap& map = search.map();
  Separation separation(search, start);
  if (!separation.find(ids)) return {};
  separation.check_one_by_one(ids);
  const Bundle& found = map.problem.bundle;
  for (std::size_t i = start.poses.size(); i < found.poses.size(); ++i) start.poses.push_back(found.poses[i]);
  for (std::size_t i = start.sizes.size(); i < found.sizes.size(); ++i) start.sizes.push_back(found.sizes[i]);
  for (std::size_t i = 0; i < start.corners.size(); ++i) {
    start.corners[i].tag = found.corners[i].tag;
    start.corners[i].size = found.corners[i].size;
  }
  return ids;
}

void join_places(const std::vector<IdPlaces>& ids, Bundle& bundle) {
  for (IdPlaces id : ids) {
    while (id.places.size() > 1) join_with_first(bundle, id.places.size() - 1, id);
  }
}

double cost_of_duplicates(const SceneMap& map, const std::vector<IdPlaces>& duplicates, double outlier_chi2) {
  constexpr double kShare = 0.75;
  double observations = 0;
  for (const IdPlaces& id : duplicates) {
    for (std::size_t i = 1; i < id.places.size(); ++i) {
      const DuplicateTag tag = describe_duplicate(map, id, i);
      observations += std::min({tag.here, tag.there, kMaxRejectedOfTag});
    }
  }
  return kShare * observations * cost_of_rejected(outlier_chi2);
}

void join_unproven(SceneSearch& search, std::vector<IdPlaces>& duplicates) {
  if (duplicates.empty() || !search.goes_on()) return;
  SceneMap& map = search.map();
  const ObservationTimes times = times_of(search.recording(), map.observations);
  const std::vector<std::vector<double>> separations = separations_of(map, duplicates);
  bool any = false;
  std::vector<IdPlaces> proven;
  for (std::size_t k = 0; k < duplicates.size(); ++k) {
    const std::size_t all = duplicates[k].places.size();
    const bool two = join_places_of_first(map, times, separations[k], duplicates[k]);
    any = any || duplicates[k].places.size() != all;
    if (two) proven.push_back(std::move(duplicates[k]));
  }
  duplicates = std::move(proven);
  if (any) search.adjust_until_stable();
}

void list_duplicates(const std::vector<IdPlaces>& duplicates, SceneMap& map) {
  for (const IdPlaces& id : duplicates) {
    if (map.placed[id.places.front().pose] == 0) continue;
    for (std::size_t i = 1; i < id.places.size(); ++i) {
      DuplicateTag duplicate = describe_duplicate(map, id, i);
      if (map.placed[duplicate.other] != 0 && duplicate.here > 0 && duplicate.there > 0)
        map.duplicate_tags.push_back(std::move(duplicate));
    }
  }
  std::ranges::stable_sort(map.duplicate_tags, {}, &DuplicateTag::tag);
}

}  // namespace waymark::internal
