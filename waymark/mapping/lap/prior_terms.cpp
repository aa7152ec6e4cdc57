#include "waymark/mapping/lap/prior_terms.hpp"

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "waymark/mapping/lap/prior_agreement.hpp"

namespace waymark::internal {
namespace {

/// Of the common part, so much is taken as common: what is left for each tag stays invertible.
constexpr double kCommonShare = 0.9;

/// S min(I, D) S^T.
Matrix6 smaller_of(const Matrix6& a, const Matrix6& b) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6> both(b, a);  // b v = d a v, V^T a V = I
  if (both.info() != Eigen::Success) return Matrix6::Zero();
  const Matrix6 S = both.eigenvectors().transpose().inverse();
  const Vector6 least = both.eigenvalues().cwiseMax(0.0).cwiseMin(1.0);
  return S * least.asDiagonal() * S.transpose();
}

TagMap tags_of(const LapBundle& lap, const TagMap& prior) {
  std::vector<char> seen(lap.bundle.poses.size(), 0);
  for (const CornerTerm& term : lap.bundle.corners) {
    if (term.used) seen[term.tag] = 1;
  }
  TagMap map;
  for (const auto& [id, pose] : lap.tags) {
    const MappedTag* before = prior.find(id);
    if (seen[pose] != 0 && before != nullptr) map.tags[id] = {lap.bundle.poses[pose].value, before->size_m};
  }
  return map;
}

void move_all(const SE3& new_T_old, LapBundle& lap) {
  const auto move = [&](PoseIndex i) { lap.bundle.poses[i].value = new_T_old * lap.bundle.poses[i].value; };
  for (const auto& [id, pose] : lap.tags) move(pose);
  for (const PoseIndex base : lap.base_poses()) move(base);
  move(lap.floor);
  for (PriorTerm& term : lap.bundle.priors) {
    if (term.pose == lap.floor) term.factor.prior = new_T_old * term.factor.prior;
  }
}

/// The pose of each tag of the prior map: that of the lap's tag where it still stands there.
void add_places(const LapPrior& prior, LapBundle& lap, TiedPrior& tied) {
  const std::set<TagId> agreeing(tied.agreeing.begin(), tied.agreeing.end());
  for (const auto& [id, tag] : prior.map.tags) {
    const bool held = is_held(prior, id, tag);
    if (!agreeing.contains(id)) {
      tied.before[id] = lap.bundle.add(tag.map_T_tag, held);
      continue;
    }
    BundlePose& pose = lap.bundle.poses[tied.before[id] = lap.tags.at(id)];
    pose.fixed = held;
    if (held) pose.value = tag.map_T_tag;
  }
}

/// The floor of the prior map is that of the new one. What defined the lap's own map does so no more.
void hold_the_floor(const LapPrior& prior, LapBundle& lap) {
  std::set<PoseIndex> tags;
  for (const auto& [id, pose] : lap.tags) tags.insert(pose);
  std::erase_if(lap.bundle.priors, [&](const PriorTerm& term) { return tags.contains(term.pose); });
  lap.anchor.reset();
  if (!prior.map.floor.covariance) return;
  SE3& map_T_plane = lap.bundle.poses[lap.floor].value;
  map_T_plane = SE3(map_T_floor(prior.map.floor).rotation(), map_T_plane.translation());
  for (PriorTerm& term : lap.bundle.priors) {
    if (term.pose == lap.floor) term.factor = floor_prior(map_T_plane, true);
  }
}

/// What the prior map knows, once each of its tags has a pose.
void add_terms(const LapPrior& prior, LapBundle& lap, const TiedPrior& tied) {
  const Matrix6 slack = 1e-10 * Matrix6::Identity();
  const Matrix6 common = kCommonShare * common_covariance(prior.map);
  const PoseIndex old = lap.bundle.add({});  // where the frame of the prior map lies in the map
  lap.bundle.priors.push_back({old, {{}, whitening_of(Matrix6(common + 1e-12 * Matrix6::Identity()))}});
  for (const auto& [id, tag] : prior.map.tags) {
    if (!tag.covariance || lap.bundle.poses[tied.before.at(id)].fixed) continue;
    const MappedTag* to = tag.tie ? prior.map.find(tag.tie->to) : nullptr;
    if (to == nullptr || !to->covariance) {
      const Matrix6 own = *tag.covariance - common + slack;
      lap.bundle.relatives.push_back({old, tied.before.at(id), {tag.map_T_tag, {}, whitening_of(own)}});
      continue;
    }
    const TiedError error = tied_error(tag, *to);
    lap.bundle.pair_priors.push_back(
        {tied.before.at(tag.tie->to),
         tied.before.at(id),
         {to->map_T_tag, tag.map_T_tag, error.gain, whitening_of(Matrix6(error.covariance + slack))}});
  }
}

}  // namespace

Matrix6 common_covariance(const TagMap& map) {
  if (is_measured(map)) return Matrix6::Zero();
  std::optional<Matrix6> common;
  for (const auto& [id, tag] : map.tags) {
    if (!tag.covariance || tag.tie) continue;
    const Matrix6 P = *tag.covariance + 1e-12 * Matrix6::Identity();
    common = common ? smaller_of(*common + 1e-12 * Matrix6::Identity(), P) : P;
  }
  return common.value_or(Matrix6::Zero());
}

Result<TiedPrior> tie_to_prior(const LapPrior& prior, const TagId& anchor, const BundleCovariance& known,
                               LapBundle& lap) {
  const TagMap now = tags_of(lap, prior.map);
  const Result<MapComparison> comparison = compare_maps(now, prior.map);
  if (!comparison)
    return fail(ErrorCode::NotFound, "the lap does not fit the map that it should extend: no two tags agree",
                {},
                "Is it a lap of this place? `waymark map LAP --prior MAP` maps it by itself and holds it "
                "against the map.");
  // Where the anchor of laps still stands both maps are in one frame, and their covariances say how far apart
  // they may be; aligning them by all tags would hide that.
  if (is_measured(prior.map) || !stands_where_it_was(*comparison, anchor))
    move_all(comparison->map_T_prior.inverse(), lap);
  TiedPrior tied{.comparison = *comparison};
  find_agreeing(prior, now, lap, anchor, known, tied);
  add_places(prior, lap, tied);
  add_terms(prior, lap, tied);
  hold_the_floor(prior, lap);
  // The lap's own anchor was held where the prior map has it: from now on it is a tag like any other.
  for (const auto& [id, index] : lap.tags) {
    if (std::ranges::find(tied.agreeing, id) == tied.agreeing.end()) lap.bundle.poses[index].fixed = false;
  }
  return tied;
}

TiePairs pairs_to_tie(const LapInput& input, const LapBundle& lap, const std::optional<TiedPrior>& tied) {
  const auto pose_of = [&](const TagId& tag) -> std::optional<PoseIndex> {
    if (const auto here = lap.tags.find(tag); here != lap.tags.end()) return here->second;
    if (!tied) return std::nullopt;
    const auto before = tied->before.find(tag);
    return before != tied->before.end() ? std::optional(before->second) : std::nullopt;
  };
  TiePairs pairs;
  for (const auto& [a, b] : tie_candidates(input, lap)) {
    const auto pose_a = pose_of(a);
    const auto pose_b = pose_of(b);
    if (!pose_a || !pose_b || lap.bundle.poses[*pose_a].fixed || lap.bundle.poses[*pose_b].fixed) continue;
    pairs.tags.emplace_back(a, b);
    pairs.poses.emplace_back(*pose_a, *pose_b);
  }
  return pairs;
}

}  // namespace waymark::internal
