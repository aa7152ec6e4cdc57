#include "waymark/mapping/scene/tag_identity.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <Eigen/Cholesky>

#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/scene/vacated_places.hpp"
#include "waymark/mapping/solver/changed_tags.hpp"
#include "waymark/mapping/solver/pose_votes.hpp"

namespace waymark {
namespace {

const SE3& pose_at(const SceneMap& map, const IdPlace& place) {
  return map.problem.bundle.poses[place.pose].value;
}

double distance_between(const SceneMap& map, const IdPlace& a, const IdPlace& b) {
  return (pose_at(map, a).translation() - pose_at(map, b).translation()).norm();
}

bool are_observed_in_turn(const SceneMap& map, const IdPlace& a, const IdPlace& b) {
  const std::vector<std::size_t> first = frames_of(map, a);
  const std::vector<std::size_t> second = frames_of(map, b);
  return !first.empty() && !second.empty() && are_apart_in_time(first, second);
}

double side_at(const SceneMap& map, const IdPlace& place) {
  return side_m(map.problem.bundle, map.problem.bundle.corners[place.terms.front()]);
}

/// Whether the observations at a place are those of another tag, whose id was misread.
bool is_misread_at(const SceneMap& map, const IdPlaces& id, const IdPlace& place) {
  std::map<PoseIndex, int> used;
  for (const CornerTerm& term : map.problem.bundle.corners) used[term.tag] += term.used ? 1 : 0;
  for (std::size_t t = 0; t < map.problem.tags[id.body].size(); ++t) {
    const PoseIndex other = map.problem.tags[id.body][t];
    if (t != id.tag && map.placed[other] != 0 &&
        is_misread({pose_at(map, place), static_cast<double>(place.terms.size())},
                   {map.problem.bundle.poses[other].value, static_cast<double>(used[other])},
                   side_at(map, place)))
      return true;
  }
  return false;
}

/// The number of observations that fit a place.
std::ptrdiff_t fitting(const SceneMap& map, const IdPlace& place) {
  constexpr double kMaxChi2 = 100;
  const Bundle& bundle = map.problem.bundle;
  return std::ranges::count_if(place.terms, [&](std::size_t i) {
    const CornerTerm& term = bundle.corners[i];
    const auto r = corner_residual(term.factor, bundle.cameras[term.camera], poses_of(bundle, term));
    return term.used && r && r->squaredNorm() * map.correlated_frames < kMaxChi2;
  });
}

/// Whether two prints can be at these places: the poses differ by more than systematic errors explain, and
/// the prints would not overlap. A mirrored pose of a small tag would.
bool can_be_two_prints(const SceneMap& map, const IdPlace& a, const IdPlace& b) {
  constexpr double kMinDistance_m = 0.03;
  constexpr double kMinAngle_rad = 0.1;
  const SE3 change = pose_at(map, a).inverse() * pose_at(map, b);
  const bool differ =
      change.translation().norm() > kMinDistance_m || change.rotation().log().norm() > kMinAngle_rad;
  return differ && !would_overlap(pose_at(map, a), pose_at(map, b), side_at(map, a));
}

}  // namespace

TagIdentity identity_of(const SceneMap& map, const ObservationTimes& times, const IdPlaces& id,
                        std::size_t place, double separation_chi2) {
  const IdPlace& here = id.places.front();
  const IdPlace& there = id.places[place];
  if (separation_chi2 < internal::kPoseGate ||
      std::min(fitting(map, here), fitting(map, there)) < kMinTermsOfTag ||
      !can_be_two_prints(map, here, there) || is_misread_at(map, id, here) || is_misread_at(map, id, there))
    return TagIdentity::OneTag;
  if (are_observed_at_once(map, here, there)) return TagIdentity::TwoTags;
  const bool is_short_move =
      distance_between(map, here, there) < kMaxMoved_m && are_observed_in_turn(map, here, there);
  return is_short_move || was_vacated(map, times, id, here, there) ? TagIdentity::MovedTag
                                                                   : TagIdentity::TwoTags;
}

std::vector<std::vector<double>> separations_of(const SceneMap& map, const std::vector<IdPlaces>& ids) {
  const Bundle& bundle = map.problem.bundle;
  std::vector<std::pair<PoseIndex, PoseIndex>> pairs;
  for (const IdPlaces& id : ids) {
    for (const IdPlace& place : id.places) pairs.emplace_back(id.places.front().pose, place.pose);
  }
  const BundleCovariance P = covariance(bundle, pairs);
  std::vector<std::vector<double>> separations;
  std::size_t pair = 0;
  for (const IdPlaces& id : ids) {
    separations.emplace_back();
    for (const IdPlace& place : id.places) {
      const auto [a, b] = pairs[pair];
      const Matrix6& mixed = P.pairs[pair++];
      double& chi2 = separations.back().emplace_back(0);
      if (&place == &id.places.front() || map.placed[a] == 0 || map.placed[b] == 0) continue;
      const Vector6 off = minus(bundle.poses[b].value, bundle.poses[a].value);
      const Matrix6 of_difference = P.poses[a] + P.poses[b] - mixed - mixed.transpose();
      chi2 = off.dot(of_difference.ldlt().solve(off));
    }
  }
  return separations;
}

bool may_be_second_tag(const SceneMap& map, const IdPlaces& id, std::size_t place) {
  const IdPlace& here = id.places.front();
  const IdPlace& there = id.places[place];
  if (map.placed[here.pose] == 0 || map.placed[there.pose] == 0) return false;
  if (are_observed_at_once(map, here, there)) return true;
  return are_clearly_apart(pose_at(map, here), pose_at(map, there)) &&
         (distance_between(map, here, there) >= kMaxMoved_m || !are_observed_in_turn(map, here, there));
}

bool are_proven_two(const SceneMap& map, const IdPlaces& id) {
  return std::any_of(id.places.begin() + 1, id.places.end(), [&](const IdPlace& place) {
    return are_observed_at_once(map, id.places.front(), place);
  });
}

DuplicateTag describe_duplicate(const SceneMap& map, const IdPlaces& id, std::size_t place) {
  const IdPlace& here = id.places.front();
  const IdPlace& there = id.places[place];
  const auto used = [&](const IdPlace& at) {
    return static_cast<int>(std::ranges::count_if(at.terms, [&](std::size_t i) {
      const CornerTerm& term = map.problem.bundle.corners[i];
      return term.used && term.tag == at.pose;
    }));
  };
  const bool is_static = map.scene.bodies[id.body].is_static;
  const SE3 map_T_body =
      is_static ? map.problem.bundle.poses[map.problem.bodies[id.body].front()].value : SE3();
  return {.tag = map.scene.bodies[id.body].tags[id.tag].id,
          .other = there.pose,
          .here_m = map_T_body * pose_at(map, here).translation(),
          .there_m = map_T_body * pose_at(map, there).translation(),
          .moving_body = is_static ? std::string() : map.scene.bodies[id.body].name,
          .distance_m = distance_between(map, here, there),
          .here = used(here),
          .there = used(there),
          .at_once = are_observed_at_once(map, here, there),
          .one_after_the_other =
              !are_observed_at_once(map, here, there) && are_observed_in_turn(map, here, there)};
}

}  // namespace waymark
