#include "waymark/mapping/lap/prior_map.hpp"

#include <algorithm>
#include <functional>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "waymark/base/angles.hpp"
#include "waymark/pose/agreement.hpp"

namespace waymark::internal {
namespace {

using Matrix8 = Eigen::Matrix<double, 8, 8>;
using PoseByPrint = Eigen::Matrix<double, 6, 8>;

/// Sums over the observations of a tag.
struct Sums {
  Matrix6 information = Matrix6::Zero();
  PoseByPrint by_print = PoseByPrint::Zero();
};

/// Derivative of the whitened corners with respect to the corner positions (x, y of each) in the plane of the
/// tag.
Matrix8 by_corners_of(const CornerTerm& term, const Eigen::Matrix<double, 8, 6>& plain,
                      const SE3& map_T_tag) {
  const Eigen::Matrix<double, 3, 2> plane = map_T_tag.rotation().matrix().leftCols<2>();
  Matrix8 J = Matrix8::Zero();
  // Displacing one corner has the same effect on that corner as displacing the whole tag.
  for (Eigen::Index c = 0; c < 8; c += 2) J.block<2, 2>(c, c) = plain.block<2, 3>(c, 0) * plane;
  return term.factor.whitening * J;
}

}  // namespace

std::map<PoseIndex, Matrix6> covariance_of_print(const Bundle& bundle, double sigma_m) {
  std::map<PoseIndex, Sums> tags;
  for (const CornerTerm& term : bundle.corners) {
    if (!term.used) continue;
    CornerFactor plain = term.factor;
    plain.whitening.setIdentity();
    plain.isotropic = true;
    const auto pose = [&](PoseIndex i) { return bundle.poses[i].value; };
    CornerJacobians J;
    J.wants_rig = J.wants_cam = J.wants_body = false;
    if (!corner_residual(plain, bundle.cameras[term.camera], poses_of(bundle, term), &J)) continue;
    const Eigen::Matrix<double, 8, 6> white = term.factor.whitening * J.tag;
    Sums& sums = tags[term.tag];
    sums.information += white.transpose() * white;
    sums.by_print += white.transpose() * by_corners_of(term, J.tag, pose(term.tag));
  }
  std::map<PoseIndex, Matrix6> covariances;
  for (const auto& [tag, sums] : tags) {
    const Eigen::LLT<Matrix6> llt(sums.information);
    if (llt.info() != Eigen::Success) continue;
    const PoseByPrint off = sigma_m * llt.solve(sums.by_print);
    covariances[tag] = off * off.transpose();
  }
  return covariances;
}

namespace {

/// Only this share of the common covariance is used, so that the remaining covariance of each tag stays
/// invertible.
constexpr double kCommonShare = 0.9;

/// Computes S min(I, D) S^T.
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
  for (const SeparatedTag& tag : lap.moves) move(tag.earlier);
  for (const PoseIndex base : lap.base_poses()) move(base);
  move(lap.floor);
  for (PriorTerm& term : lap.bundle.priors) {
    if (term.pose == lap.floor) term.factor.prior = new_T_old * term.factor.prior;
  }
}

/// Adds a pose for each tag in the prior map; for an unmoved tag, the pose of the lap's tag is used.
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

/// Uses the floor of the prior map, and removes the definition of the lap's map frame.
void use_prior_floor(const LapPrior& prior, LapBundle& lap) {
  std::set<PoseIndex> tags;
  for (const auto& [id, pose] : lap.tags) tags.insert(pose);
  for (const SeparatedTag& tag : lap.moves) tags.insert(tag.earlier);
  std::erase_if(lap.bundle.priors, [&](const PriorTerm& term) { return tags.contains(term.pose); });
  lap.anchor.reset();
  if (!prior.map.floor.covariance) return;
  SE3& map_T_plane = lap.bundle.poses[lap.floor].value;
  map_T_plane = SE3(map_T_floor(prior.map.floor).rotation(), map_T_plane.translation());
  for (PriorTerm& term : lap.bundle.priors) {
    if (term.pose == lap.floor) term.factor = floor_prior(map_T_plane, true);
  }
}

/// Adds the information from the prior map. Each of its tags must already have a pose.
void add_terms(const LapPrior& prior, LapBundle& lap, const TiedPrior& tied) {
  const Matrix6 slack = 1e-10 * Matrix6::Identity();
  const Matrix6 common = kCommonShare * common_covariance(prior.map);
  const PoseIndex old = lap.bundle.add({});  // pose of the prior map's frame in the new map
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
    return fail(ErrorCode::NotFound,
                "the lap does not fit the map to be extended: " + comparison.error().message, {},
                "Check that the lap was recorded at this place, or map it separately, without `extend`.");
  // If the prior map was made from laps and the anchor is unmoved, both maps are in the same frame, and their
  // covariances bound the distances. An alignment using all tags would hide errors.
  if (is_measured(prior.map) || !is_unmoved(*comparison, anchor))
    move_all(comparison->map_T_prior.inverse(), lap);
  TiedPrior tied{.comparison = *comparison};
  find_agreeing(prior, now, lap, anchor, known, tied);
  add_places(prior, lap, tied);
  add_terms(prior, lap, tied);
  use_prior_floor(prior, lap);
  // The lap's anchor was fixed at its pose in the prior map; from now on, it is an ordinary tag.
  for (const auto& [id, index] : lap.tags) {
    if (std::ranges::find(tied.agreeing, id) == tied.agreeing.end()) lap.bundle.poses[index].fixed = false;
  }
  for (const SeparatedTag& tag : lap.moves) lap.bundle.poses[tag.earlier].fixed = false;
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

namespace {

/// The position error of a printed corner due to paper, glue and the systematic error of the detector.
constexpr double kPrinted_m = 0.0005;
constexpr double kMaxDistance_m = 0.5;

using Matrices = std::map<PoseIndex, Matrix6>;

Matrix6 print_of(const Matrices& printed, const LapBundle& lap, const TagId& tag) {
  const auto pose = lap.tags.find(tag);
  const auto at = pose != lap.tags.end() ? printed.find(pose->second) : printed.end();
  return at != printed.end() ? at->second : Matrix6::Zero();
}

/// The squared distance between a tag's pose in the lap, with covariance `P`, and its pose in the map,
/// whitened by both uncertainties.
double distance2(const SE3& map_T_tag, const Matrix6& P, const MappedTag& before) {
  const Matrix6 slack = 1e-6 * Matrix6::Identity();  // 1 mm, 1 mrad
  const Vector6 off = minus(map_T_tag, before.map_T_tag);
  const Matrix6 S = P + before.covariance.value_or(Matrix6::Zero()) + slack;
  return off.dot(S.llt().solve(off));
}

std::string contradiction(const TagId& tag, const SE3& now, const SE3& before) {
  return fmt::format(
      "{} moved by {:.0f} mm and {:.1f} deg, more than both uncertainties allow; the map now has the new "
      "pose",
      to_string(tag), 1000 * (now.translation() - before.translation()).norm(),
      to_degrees((now.rotation().inverse() * before.rotation()).angle()));
}

/// Whether a tag was moved during the lap, which is reported separately.
bool was_moved_in_lap(const LapBundle& lap, const TagId& tag) {
  const auto pose = lap.tags.find(tag);
  return pose != lap.tags.end() &&
         std::ranges::find(lap.moves, pose->second, &SeparatedTag::later) != lap.moves.end();
}

void write_messages(const LapPrior& prior, const LapBundle& lap, TiedPrior& tied) {
  tied.warnings.clear();
  for (const ComparedTag& compared : tied.comparison.tags) {
    if (compared.change == TagChange::Swapped && compared.tag < *compared.with)
      tied.warnings.push_back(fmt::format("{} and {} are swapped compared with the map to be extended",
                                          to_string(compared.tag), to_string(*compared.with)));
    const bool moved = std::ranges::find(tied.moved, compared.tag) != tied.moved.end();
    if (moved && !was_moved_in_lap(lap, compared.tag))
      tied.warnings.push_back(contradiction(compared.tag, lap.bundle.poses[lap.tags.at(compared.tag)].value,
                                            prior.map.find(compared.tag)->map_T_tag));
  }
}

/// Makes the prior map's term for a tag apply to this pose from now on.
void attach_prior(PoseIndex pose, const TagId& tag, LapBundle& lap, TiedPrior& tied) {
  for (RelativeTerm& term : lap.bundle.relatives) term.b = term.b == tied.before.at(tag) ? pose : term.b;
  tied.before[tag] = pose;
}

bool tie_more(const LapPrior& prior, const Matrices& printed, const BundleCovariance& known, LapBundle& lap,
              TiedPrior& tied) {
  const auto agrees = [&](const TagId& tag) {
    const PoseIndex pose = lap.tags.at(tag);
    const SE3& map_T_tag = lap.bundle.poses[pose].value;
    const MappedTag& before = *prior.map.find(tag);
    return !tied.untied.contains(tag) &&
           (map_T_tag.translation() - before.map_T_tag.translation()).norm() < kMaxDistance_m &&
           distance2(map_T_tag, known.poses[pose] + print_of(printed, lap, tag), before) < kPoseGate;
  };
  const auto now = std::ranges::stable_partition(tied.moved, std::not_fn(agrees));
  for (const TagId& tag : now) {
    const PoseIndex own = lap.tags.at(tag);
    BundlePose& pose = lap.bundle.poses[own];
    pose.fixed = is_held(prior, tag, *prior.map.find(tag));
    if (pose.fixed) pose.value = prior.map.find(tag)->map_T_tag;
    lap.bundle.poses[tied.before.at(tag)].fixed = true;  // no term depends on it any more
    attach_prior(own, tag, lap, tied);
    tied.agreeing.push_back(tag);
  }
  const bool more = !now.empty();
  tied.moved.erase(now.begin(), now.end());
  return more;
}

/// The same distance for a tied tag, using its pose according to the lap and the other tags, without the
/// information from its prior. Returns 0 if no information remains.
double distance2_without(const TagId& tag, const MappedTag& before, const Matrix6& of_print,
                         const BundleCovariance& known, const LapBundle& lap) {
  const PoseIndex pose = lap.tags.at(tag);
  if (lap.bundle.poses[pose].fixed || !before.covariance) return 0;
  const Matrix6& P = known.poses[pose];
  const Eigen::LLT<Matrix6> information_without_prior(*before.covariance - P);
  if (information_without_prior.info() != Eigen::Success) return 0;
  const Vector6 off = minus(lap.bundle.poses[pose].value, before.map_T_tag);
  const Vector6 off_without = *before.covariance * information_without_prior.solve(off);
  const Matrix6 P_without = *before.covariance * information_without_prior.solve(P);
  return distance2(SE3::exp(off_without) * before.map_T_tag, P_without + of_print, before);
}

bool untie_worst(const LapPrior& prior, const Matrices& printed, const BundleCovariance& known,
                 LapBundle& lap, TiedPrior& tied) {
  std::vector<double> off;
  off.reserve(tied.agreeing.size());
  for (const TagId& tag : tied.agreeing)
    off.push_back(distance2_without(tag, *prior.map.find(tag), print_of(printed, lap, tag), known, lap));
  const auto worst = std::ranges::max_element(off);
  if (worst == off.end() || *worst < kPoseGate) return false;
  const auto at = tied.agreeing.begin() + (worst - off.begin());
  attach_prior(lap.bundle.add(prior.map.find(*at)->map_T_tag), *at, lap, tied);
  tied.untied.insert(*at);
  tied.moved.push_back(*at);
  tied.agreeing.erase(at);
  return true;
}

}  // namespace

bool is_measured(const TagMap& map) {
  return std::ranges::all_of(map.tags,
                             [](const auto& tag) { return tag.second.covariance && !tag.second.tie; });
}

bool is_held(const LapPrior& prior, const TagId& tag, const MappedTag& mapped) {
  return prior.frozen.contains(tag) || !mapped.covariance;
}

bool is_unmoved(const MapComparison& comparison, const TagId& tag) {
  const auto at = std::ranges::find(comparison.tags, tag, &ComparedTag::tag);
  return at != comparison.tags.end() && (at->change == TagChange::Same || at->change == TagChange::Resized);
}

void find_agreeing(const LapPrior& prior, const TagMap& now, const LapBundle& lap, const TagId& anchor,
                   const BundleCovariance& known, TiedPrior& tied) {
  // The lap uses the anchor pose from the prior map. Its error moves all other tags, and distant ones more
  // than near ones.
  const MappedTag* anchor_tag = prior.map.find(anchor);
  const Matrix6 of_anchor =
      anchor_tag != nullptr ? anchor_tag->covariance.value_or(Matrix6::Zero()) : Matrix6::Zero();
  const bool measured = is_measured(prior.map);
  for (const ComparedTag& compared : tied.comparison.tags) {
    const MappedTag* before = prior.map.find(compared.tag);
    if (before == nullptr || now.find(compared.tag) == nullptr || compared.change == TagChange::Swapped)
      continue;
    const PoseIndex pose = lap.tags.at(compared.tag);
    const bool agrees = measured ? is_unmoved(tied.comparison, compared.tag)
                                 : compared.distance_m < kMaxDistance_m &&
                                       distance2(lap.bundle.poses[pose].value, known.poses[pose] + of_anchor,
                                                 *before) < kPoseGate;
    (agrees ? tied.agreeing : tied.moved).push_back(compared.tag);
  }
  write_messages(prior, lap, tied);
}

bool revise_agreement(const LapPrior& prior, LapBundle& lap, TiedPrior& tied) {
  bool changed = false;
  if (is_measured(prior.map)) {
    const BundleCovariance known = covariance(lap.bundle);
    const Matrices printed = covariance_of_print(lap.bundle, kPrinted_m);
    changed = tie_more(prior, printed, known, lap, tied) || untie_worst(prior, printed, known, lap, tied);
  }
  write_messages(prior, lap, tied);  // using the current poses
  return changed;
}

}  // namespace waymark::internal
