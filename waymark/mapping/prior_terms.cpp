#include "waymark/mapping/prior_terms.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

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

bool is_held(const LapPrior& prior, const TagId& tag, const MappedTag& mapped) {
  return prior.frozen.contains(tag) || !mapped.covariance;
}

Matrix6 own_covariance(const MappedTag& tag, const Matrix6& common) {
  return tag.covariance.value_or(Matrix6::Zero()) - common + 1e-10 * Matrix6::Identity();
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
  for (const auto& base : lap.bases) {
    if (base) move(*base);
  }
  move(lap.floor);
  for (PriorTerm& term : lap.bundle.priors) {
    if (term.pose == lap.floor) term.factor.prior = new_T_old * term.factor.prior;
  }
}

bool stands_where_it_was(const MapComparison& comparison, const TagId& tag) {
  const auto at = std::ranges::find(comparison.tags, tag, &ComparedTag::tag);
  return at != comparison.tags.end() && (at->change == TagChange::Same || at->change == TagChange::Resized);
}

std::string contradiction(const TagId& tag, const SE3& now, const SE3& before) {
  constexpr double kDegrees = 57.29577951308232;
  return fmt::format(
      "{} stands {:.0f} mm and {:.1f} deg from where the map has it, more than both can be wrong by: it was "
      "moved, "
      "and the map has its new place",
      to_string(tag), 1000 * (now.translation() - before.translation()).norm(),
      kDegrees * (now.rotation().inverse() * before.rotation()).angle());
}

/// The tags whose places in the lap and in the prior map are one place, as far as the two know.
void find_agreeing(const LapPrior& prior, const TagMap& now, const LapBundle& lap,
                   const BundleCovariance& known, TiedPrior& tied) {
  constexpr double kGate = 22.5;  // 0.999 quantile of chi-square with 6 degrees of freedom
  constexpr double kFarthest_m = 0.5;
  const Matrix6 slack = 1e-6 * Matrix6::Identity();  // a millimetre, a milliradian
  for (const ComparedTag& compared : tied.comparison.tags) {
    const MappedTag* before = prior.map.find(compared.tag);
    const MappedTag* here = now.find(compared.tag);
    if (before == nullptr || here == nullptr) continue;
    const SE3& map_T_tag = lap.bundle.poses[lap.tags.at(compared.tag)].value;
    const Vector6 off = minus(map_T_tag, before->map_T_tag);
    const Matrix6 S =
        known.poses[lap.tags.at(compared.tag)] + before->covariance.value_or(Matrix6::Zero()) + slack;
    const bool swapped = compared.change == TagChange::Swapped;
    if (!swapped && compared.distance_m < kFarthest_m && off.dot(S.llt().solve(off)) < kGate) {
      tied.agreeing.push_back(compared.tag);
    } else if (swapped && compared.tag < *compared.with) {
      tied.words.push_back(fmt::format("{} and {} are swapped against the map that is extended",
                                       to_string(compared.tag), to_string(*compared.with)));
    } else if (!swapped) {
      tied.words.push_back(contradiction(compared.tag, map_T_tag, before->map_T_tag));
    }
  }
}

}  // namespace

Matrix6 common_covariance(const TagMap& map) {
  std::optional<Matrix6> common;
  for (const auto& [id, tag] : map.tags) {
    if (!tag.covariance) continue;
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
                {}, "Is it a lap of this place? Map it by itself and hold it against the map with --prior.");
  // Where the anchor still stands both maps are in one frame, and their covariances say how far apart they
  // may be; aligning them by all tags would hide that.
  if (!stands_where_it_was(*comparison, anchor)) move_all(comparison->map_T_prior.inverse(), lap);
  TiedPrior tied{.comparison = *comparison};
  find_agreeing(prior, now, lap, known, tied);
  tied.common = kCommonShare * common_covariance(prior.map);
  tied.old = lap.bundle.add({});
  const Matrix6 common = tied.common + 1e-12 * Matrix6::Identity();
  lap.bundle.priors.push_back({tied.old, {{}, whitening_of(common)}});
  for (const TagId& id : tied.agreeing) {
    const MappedTag& before = prior.map.tags.at(id);
    BundlePose& pose = lap.bundle.poses[lap.tags.at(id)];
    pose.fixed = is_held(prior, id, before);
    if (pose.fixed) {
      pose.value = before.map_T_tag;
      continue;
    }
    lap.bundle.relatives.push_back(
        {tied.old,
         lap.tags.at(id),
         {before.map_T_tag, {}, whitening_of(own_covariance(before, tied.common))}});
  }
  // The lap's own anchor was held where the prior map has it: from now on it is a tag like any other.
  for (const auto& [id, index] : lap.tags) {
    if (std::ranges::find(tied.agreeing, id) == tied.agreeing.end()) lap.bundle.poses[index].fixed = false;
  }
  return tied;
}

MappedTag unseen_tag(const LapPrior& prior, const TagId& tag, const TiedPrior& tied, const Bundle& bundle,
                     const BundleCovariance& P) {
  MappedTag mapped = prior.map.tags.at(tag);
  if (is_held(prior, tag, mapped)) return mapped;
  mapped.covariance = P.poses[tied.old] + own_covariance(mapped, tied.common);
  mapped.map_T_tag = bundle.poses[tied.old].value * mapped.map_T_tag;
  return mapped;
}

}  // namespace waymark::internal
