#include "waymark/mapping/scene/id_places.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/solver/tag_place.hpp"

namespace waymark {
namespace {

using TagIndex = std::pair<std::size_t, std::size_t>;  // body and tag

TagIndex tag_of(const SceneObservation& seen) { return {seen.body, seen.tag}; }

/// The largest place first.
void sort_by_size(IdPlaces& id) {
  std::ranges::stable_sort(id.places, std::greater<>{},
                           [](const IdPlace& place) { return place.terms.size(); });
}

}  // namespace

std::vector<IdPlaces> ids_in_groups(const SceneMap& map, const std::vector<std::size_t>& groups,
                                    std::size_t least) {
  const std::vector<SceneObservation>& seen = map.observations.seen;
  std::vector<std::size_t> size(seen.size(), 0);
  for (const std::size_t group : groups) ++size[group];
  std::map<TagIndex, int> groups_of_tag;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (groups[i] == i && size[i] >= least) ++groups_of_tag[tag_of(seen[i])];
  }
  struct Observed {
    std::vector<std::size_t> terms{};
    std::map<std::size_t, IdPlace> places{};
  };
  std::map<TagIndex, Observed> tags;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto several = groups_of_tag.find(tag_of(seen[i]));
    if (several == groups_of_tag.end() || several->second < 2) continue;
    Observed& tag = tags[tag_of(seen[i])];
    tag.terms.push_back(i);
    if (size[groups[i]] >= least) tag.places[groups[i]].terms.push_back(i);
  }
  std::vector<IdPlaces> ids;
  for (auto& [tag, observed] : tags) {
    IdPlaces& id =
        ids.emplace_back(IdPlaces{.body = tag.first, .tag = tag.second, .terms = std::move(observed.terms)});
    for (auto& [group, place] : observed.places) id.places.push_back(std::move(place));
    sort_by_size(id);
  }
  return ids;
}

namespace {

using PoseOfPlace = std::function<std::optional<SE3>(const IdPlace&)>;

/// Moves the place that is nearest to a pose to the front.
void put_nearest_first(const SE3& pose, const PoseOfPlace& pose_of, IdPlaces& id) {
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < id.places.size(); ++i) {
    const std::optional<SE3> at = pose_of(id.places[i]);
    if (!at) continue;
    const double distance = (at->translation() - pose.translation()).norm();
    if (distance < least) nearest = i;
    least = std::min(least, distance);
  }
  std::rotate(id.places.begin(), id.places.begin() + static_cast<std::ptrdiff_t>(nearest),
              id.places.begin() + static_cast<std::ptrdiff_t>(nearest) + 1);
}

void choose_first(const SceneMap& map, const PoseOfPlace& pose_of, IdPlaces& id) {
  const BundlePose& of_tag = map.problem.bundle.poses[map.problem.tags[id.body][id.tag]];
  if (const std::optional<ScenePrior>& given = map.scene.bodies[id.body].tags[id.tag].body_T_tag) {
    put_nearest_first(given->mean, pose_of, id);
    return;
  }
  if (of_tag.fixed) {
    put_nearest_first(of_tag.value, pose_of, id);
    return;
  }
  if (id.places.size() < 2) return;
  std::array<std::vector<std::size_t>, 2> frames;
  for (std::size_t p = 0; p < 2; ++p) {
    for (const std::size_t i : id.places[p].terms) frames[p].push_back(map.observations.seen[i].frame);
  }
  if (are_apart_in_time(frames[0], frames[1]) && is_earlier(frames[0], frames[1]))
    std::swap(id.places[0], id.places[1]);
}

/// Moves the terms that fit a place, and their votes, into the place.
void take_agreeing(const Bundle& bundle, std::vector<const CornerTerm*>& terms,
                   std::vector<internal::Vote<SE3>>& votes, IdPlace& place) {
  std::size_t rest = 0;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (internal::nearest(votes[i], *place.start, internal::kPoseGate).first != nullptr) {
      place.terms.push_back(static_cast<std::size_t>(terms[i] - bundle.corners.data()));
      continue;
    }
    terms[rest] = terms[i];
    if (rest != i) votes[rest] = std::move(votes[i]);
    ++rest;
  }
  terms.resize(rest);
  votes.resize(rest);
}

}  // namespace

std::optional<IdPlaces> places_of_size(const SceneMap& map, std::size_t size) {
  const Bundle& bundle = map.problem.bundle;
  std::vector<const CornerTerm*> terms = terms_beside_others(bundle, map.placed, size);
  std::vector<internal::Vote<SE3>> votes = votes_for_tag(bundle, terms, squares_of(bundle, terms));
  IdPlaces id;
  while (std::ssize(terms) >= kMinTermsOfTag && id.places.size() <= kMaxPlaces) {
    const auto agreed = internal::agree(votes, internal::kPoseGate);
    if (!agreed || agreed->votes < kMinTermsOfTag) break;
    IdPlace place{.start = agreed->value.mean};
    take_agreeing(bundle, terms, votes, place);
    if (std::ssize(place.terms) < kMinTermsOfTag) break;
    id.places.push_back(std::move(place));
  }
  if (id.places.size() < 2 || id.places.size() > kMaxPlaces) return std::nullopt;
  const SceneObservation& seen = map.observations.seen[id.places.front().terms.front()];
  id.body = seen.body;
  id.tag = seen.tag;
  for (std::size_t i = 0; i < bundle.corners.size(); ++i) {
    if (bundle.corners[i].size == size) id.terms.push_back(i);
  }
  sort_by_size(id);
  const auto start_of = [](const IdPlace& place) { return place.start; };
  choose_first(map, start_of, id);
  return id;
}

namespace {

/// Adds the observations of the id that have no place to the one that was observed nearest in time.
void add_other_terms(const SceneMap& map, IdPlaces& id) {
  const std::vector<SceneObservation>& seen = map.observations.seen;
  std::vector<std::pair<std::size_t, std::size_t>> placed;  // observation and place
  for (std::size_t p = 0; p < id.places.size(); ++p) {
    for (const std::size_t i : id.places[p].terms) placed.emplace_back(i, p);
  }
  std::ranges::sort(placed);
  std::size_t next = 0;
  for (const std::size_t i : id.terms) {
    while (next < placed.size() && placed[next].first < i) ++next;
    if (next < placed.size() && placed[next].first == i) continue;
    std::size_t nearest = next;
    if (next == placed.size() || (next > 0 && seen[i].frame - seen[placed[next - 1].first].frame <
                                                  seen[placed[next].first].frame - seen[i].frame))
      nearest = next - 1;
    id.places[placed[nearest].second].terms.push_back(i);
  }
  for (IdPlace& place : id.places) std::ranges::sort(place.terms);
}

}  // namespace

void separate_places(SceneMap& map, IdPlaces& id) {
  Bundle& bundle = map.problem.bundle;
  add_other_terms(map, id);
  const PoseIndex of_tag = bundle.corners[id.places.front().terms.front()].tag;
  const std::size_t size_of_tag = bundle.corners[id.places.front().terms.front()].size.value();
  for (IdPlace& place : id.places) {
    const bool first = &place == &id.places.front();
    place.pose = first ? of_tag : bundle.add(bundle.poses[of_tag].value);
    place.size = first ? size_of_tag : bundle.sizes.size();
    if (!first) {
      const BundleSize same = bundle.sizes[size_of_tag];
      bundle.sizes.push_back(same);
      map.problem.moves.push_back(0);
      if (!map.placed.empty()) map.placed.push_back(1);
    }
    if (place.start && !bundle.poses[place.pose].fixed) bundle.poses[place.pose].value = *place.start;
    for (const std::size_t i : place.terms) {
      bundle.corners[i].tag = place.pose;
      bundle.corners[i].size = place.size;
    }
  }
}

namespace {

/// Adds the observations of a place to another one.
void add_place(Bundle& bundle, const IdPlace& place, IdPlace& to) {
  for (const std::size_t i : place.terms) {
    bundle.corners[i].tag = to.pose;
    bundle.corners[i].size = to.size;
  }
  to.terms.insert(to.terms.end(), place.terms.begin(), place.terms.end());
  std::ranges::sort(to.terms);
}

bool are_near(const SceneMap& map, const IdPlace& a, const IdPlace& b) {
  const std::vector<BundlePose>& poses = map.problem.bundle.poses;
  return map.placed[a.pose] != 0 && map.placed[b.pose] != 0 &&
         !are_clearly_apart(poses[a.pose].value, poses[b.pose].value) && !are_observed_at_once(map, a, b);
}

}  // namespace

void join_near_places(SceneMap& map, std::size_t kept, IdPlaces& id) {
  std::vector<IdPlace> joined;
  for (std::size_t i = 0; i < id.places.size(); ++i) {
    const auto from = static_cast<std::ptrdiff_t>(std::min(kept, joined.size()));
    const auto same = std::find_if(joined.begin() + from, joined.end(), [&](const IdPlace& other) {
      return i >= kept && are_near(map, id.places[i], other);
    });
    if (same == joined.end())
      joined.push_back(std::move(id.places[i]));
    else
      add_place(map.problem.bundle, id.places[i], *same);
  }
  id.places = std::move(joined);
}

void choose_place_of_map(const SceneMap& map, IdPlaces& id) {
  // Places that are not placed cannot be compared with others.
  std::ranges::stable_sort(id.places, std::greater<>{}, [&](const IdPlace& place) {
    return std::pair(map.placed[place.pose] != 0, place.terms.size());
  });
  const std::vector<BundlePose>& poses = map.problem.bundle.poses;
  const auto pose_of = [&](const IdPlace& place) {
    return map.placed[place.pose] != 0 ? std::optional(poses[place.pose].value) : std::nullopt;
  };
  choose_first(map, pose_of, id);
}

void join_with_first(Bundle& bundle, std::size_t place, IdPlaces& id) {
  add_place(bundle, id.places[place], id.places.front());
  bundle.poses[id.places[place].pose].fixed = true;  // no observation determines it any longer
  id.places.erase(id.places.begin() + static_cast<std::ptrdiff_t>(place));
}

namespace {

/// The chi-square of an observation if its tag has this pose.
double chi2_at(const Bundle& bundle, CornerTerm term, PoseIndex pose) {
  term.tag = pose;
  const auto r = corner_residual(term.factor, bundle.cameras[term.camera], poses_of(bundle, term));
  return r ? r->squaredNorm() : std::numeric_limits<double>::infinity();
}

/// The placed pose that an observation fits best; its present one if it fits none.
IdPlace& best_place(const SceneMap& map, const CornerTerm& term, IdPlaces& id) {
  const Bundle& bundle = map.problem.bundle;
  IdPlace* best = &*std::ranges::find(id.places, term.tag, &IdPlace::pose);
  double least =
      map.is_placed(term) ? chi2_at(bundle, term, term.tag) : std::numeric_limits<double>::infinity();
  for (IdPlace& place : id.places) {
    CornerTerm there = term;
    there.tag = place.pose;
    if (place.pose == term.tag || !map.is_placed(there)) continue;
    const double chi2 = chi2_at(bundle, term, place.pose);
    if (chi2 < least) best = &place;
    least = std::min(least, chi2);
  }
  return *best;
}

}  // namespace

bool assign_to_places(SceneMap& map, IdPlaces& id) {
  for (IdPlace& place : id.places) place.terms.clear();
  bool changed = false;
  for (const std::size_t i : id.terms) {
    CornerTerm& term = map.problem.bundle.corners[i];
    IdPlace& best = best_place(map, term, id);
    best.terms.push_back(i);
    changed = changed || term.tag != best.pose;
    term.tag = best.pose;
    term.size = best.size;
  }
  return changed;
}

std::vector<std::size_t> frames_of(const SceneMap& map, const IdPlace& place) {
  std::vector<std::size_t> frames;
  for (const std::size_t i : place.terms) {
    const CornerTerm& term = map.problem.bundle.corners[i];
    const std::size_t frame = map.observations.seen[i].frame;
    const bool counts = term.used && term.tag == place.pose;
    if (counts && (frames.empty() || frames.back() != frame)) frames.push_back(frame);
  }
  return frames;
}

bool are_observed_at_once(const SceneMap& map, const IdPlace& a, const IdPlace& b) {
  constexpr std::size_t kMinFrames = 2;
  std::vector<std::size_t> common;
  std::ranges::set_intersection(frames_of(map, a), frames_of(map, b), std::back_inserter(common));
  return common.size() >= kMinFrames;
}

bool are_apart_in_time(const std::vector<std::size_t>& first, const std::vector<std::size_t>& second) {
  constexpr double kMaxExceptionShare = 0.2;
  std::vector<std::pair<std::size_t, int>> both;
  both.reserve(first.size() + second.size());
  for (const std::size_t frame : first) both.emplace_back(frame, 1);
  for (const std::size_t frame : second) both.emplace_back(frame, -1);
  std::ranges::sort(both);
  const auto all_first = static_cast<int>(first.size());
  const auto all_second = static_cast<int>(second.size());
  int fewest = std::min(all_first, all_second);
  int before = 0;  // number of `first` minus number of `second` so far
  for (const auto& [frame, which] : both) {
    before += which;
    fewest = std::min({fewest, all_first - before, all_second + before});
  }
  return fewest < kMaxExceptionShare * std::min(all_first, all_second);
}

bool is_earlier(const std::vector<std::size_t>& first, const std::vector<std::size_t>& second) {
  return first[first.size() / 2] < second[second.size() / 2];
}

bool are_clearly_apart(const SE3& a, const SE3& b) {
  constexpr double kRough_m = 0.2;
  constexpr double kRough_rad = 0.5;
  const SE3 change = a.inverse() * b;
  return change.translation().norm() > kRough_m || change.rotation().log().norm() > kRough_rad;
}

}  // namespace waymark
