#include "waymark/mapping/lap/lost_poses.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/mapping/lap/lap_bundle.hpp"

namespace waymark::internal {
namespace {

/// The terms in which each pose has this role.
std::vector<std::vector<std::size_t>> terms_by(PoseIndex CornerTerm::*role, const Bundle& bundle) {
  std::vector<std::vector<std::size_t>> terms(bundle.poses.size());
  for (std::size_t i = 0; i < bundle.corners.size(); ++i) terms[bundle.corners[i].*role].push_back(i);
  return terms;
}

/// The odometry terms of each base pose.
using OdometryBeside = std::map<PoseIndex, std::vector<const OdometryTerm*>>;

/// The base pose according to odometry from an adjacent frame.
Alternative<SE3> carried(const OdometryTerm& wheels, PoseIndex base, const Bundle& bundle) {
  constexpr double kSigma_m = 0.03;
  constexpr double kSigma_rad = 0.03;
  const SE3 motion = lift(scaled_motion(wheels.factor, bundle.odometry_scales[wheels.scales].value));
  const SE3 map_T_base = wheels.b == base ? bundle.poses[wheels.a].value * motion
                                          : bundle.poses[wheels.b].value * motion.inverse();
  Vector6 sigma;
  sigma << kSigma_m, kSigma_m, kSigma_m, kSigma_rad, kSigma_rad, kSigma_rad;
  const Matrix6 whitened = sigma.cwiseInverse().asDiagonal() * map_T_base.inverse().adjoint();
  return {map_T_base, whitened.transpose() * whitened, 0};
}

/// A new pose for a frame whose observations are mostly inconsistent. It is the pose that its observations
/// and the adjacent frames agree on, if that pose has more support than the current one.
std::optional<SE3> frame_found_again(const LapInput& input, const LapBundle& lap, PoseIndex base,
                                     const std::vector<std::size_t>& terms, std::ptrdiff_t good,
                                     const std::vector<const OdometryTerm*>& beside,
                                     const std::set<PoseIndex>& lost) {
  std::vector<Vote<SE3>> votes;
  for (const std::size_t i : terms) {
    const auto [frame, detection] = lap.observations[i];
    votes.push_back(vote_for_base(input.frames[frame].detections[detection], input.frames[frame].camera,
                                  input, lap.bundle.poses[lap.bundle.corners[i].tag].value));
  }
  for (const OdometryTerm* wheels : beside) {
    if (!lost.contains(wheels->a == base ? wheels->b : wheels->a))
      votes.push_back({carried(*wheels, base, lap.bundle)});
  }
  const auto agreed = agree(votes, kPoseGate);
  if (!agreed || agreed->votes < 2 || agreed->votes <= good) return std::nullopt;
  return agreed->value.mean;
}

}  // namespace

bool reinitialise_lost_frames(const LapInput& input, const BundleMapOptions& options, LapBundle& lap) {
  const std::vector<double> chi2 = corner_chi2(lap.bundle);
  const auto terms = terms_by(&CornerTerm::rig, lap.bundle);
  const auto good = [&](PoseIndex base) {
    return std::ranges::count_if(terms[base], [&](auto i) { return chi2[i] < options.search.outlier_chi2; });
  };
  std::vector<PoseIndex> in_order;
  for (const PoseIndex base : lap.base_poses()) {
    if (2 * good(base) < std::ssize(terms[base])) in_order.push_back(base);
  }
  if (in_order.empty()) return false;
  std::set<PoseIndex> lost(in_order.begin(), in_order.end());
  OdometryBeside beside;
  for (const OdometryTerm& term : lap.bundle.odometry) {
    beside[term.a].push_back(&term);
    beside[term.b].push_back(&term);
  }
  bool any = false;
  for (const PoseIndex base : in_order) {
    const auto found = frame_found_again(input, lap, base, terms[base], good(base), beside[base], lost);
    if (!found) continue;
    lap.bundle.poses[base].value = *found;
    lost.erase(base);
    any = true;
  }
  for (CornerTerm& term : lap.bundle.corners) term.used = term.used || (any && !term.unconfirmed);
  return any;
}

bool reinitialise_lost_tags(const LapInput& input, const BundleMapOptions& options, LapBundle& lap) {
  const std::vector<double> chi2 = corner_chi2(lap.bundle);
  bool any = false;
  const auto terms = terms_by(&CornerTerm::tag, lap.bundle);
  for (const auto& [id, pose] : lap.tags) {
    const auto good =
        std::ranges::count_if(terms[pose], [&](auto i) { return chi2[i] < options.search.outlier_chi2; });
    if (lap.is_held(pose) || 2 * good >= std::ssize(terms[pose])) continue;
    std::vector<Vote<SE3>> votes;
    for (std::size_t i : terms[pose]) {
      const auto [frame, detection] = lap.observations[i];
      votes.push_back(vote_for_place(input.frames[frame].detections[detection], input.frames[frame].camera,
                                     input, lap.bundle.poses[lap.bundle.corners[i].rig].value));
    }
    const auto agreed = agree(votes, kPoseGate);
    if (!agreed || agreed->votes <= good) continue;
    lap.bundle.poses[pose].value = agreed->value.mean;
    any = true;
  }
  for (CornerTerm& term : lap.bundle.corners) term.used = term.used || (any && !term.unconfirmed);
  return any;
}

bool place_unconnected(const LapInput& input, const BundleMapOptions& options, LapBundle& lap,
                       std::vector<TagId>& unconnected) {
  constexpr int kMinObservations = 4;
  std::map<TagId, std::vector<LapBundle::Observation>> observations;
  for (const TagId& tag : unconnected) observations[tag] = {};
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    for (std::size_t d = 0; lap.bases[i] && d < input.frames[i].detections.size(); ++d) {
      const auto of_tag = observations.find(input.frames[i].detections[d].tag);
      if (of_tag != observations.end()) of_tag->second.push_back({i, d});
    }
  }
  const auto placed = std::erase_if(unconnected, [&](const TagId& tag) {
    std::vector<Vote<SE3>> votes;
    for (const auto& [frame, detection] : observations[tag]) {
      votes.push_back(vote_for_place(input.frames[frame].detections[detection], input.frames[frame].camera,
                                     input, lap.bundle.poses[*lap.bases[frame]].value));
    }
    const auto agreed = agree(votes, kPoseGate);
    if (!input.sizes.size_m(tag) || !agreed || agreed->votes < kMinObservations) return false;
    add_tag(input, tag, agreed->value.mean, observations[tag], options.model, lap);
    return true;
  });
  return placed > 0;
}

namespace {

/// The squared whitened residual of each motion.
std::vector<double> wheel_chi2(const Bundle& bundle) {
  std::vector<double> chi2;
  chi2.reserve(bundle.odometry.size());
  for (const OdometryTerm& term : bundle.odometry) {
    chi2.push_back(odometry_residual(term.factor, bundle.odometry_scales[term.scales].value,
                                     bundle.poses[term.a].value, bundle.poses[term.b].value)
                       .squaredNorm());
  }
  return chi2;
}

/// The ratio of assumed to actual odometry noise if one motion has a much larger error than the median;
/// otherwise 1.
double exactness_beside_a_jump(const Bundle& bundle) {
  constexpr std::size_t kMinMotions = 30;
  constexpr double kMinJumpRatio = 50;
  constexpr double kMedianChi2 = 2.366;  // median of chi-square with 3 degrees of freedom
  constexpr double kMaxExactness = 30;
  const std::vector<double> chi2 = wheel_chi2(bundle);
  if (chi2.size() < kMinMotions) return 1;
  const double worst = *std::ranges::max_element(chi2);
  const double usual = median(chi2);
  if (worst < kMinJumpRatio * usual) return 1;
  return std::clamp(std::sqrt(kMedianChi2 / std::max(usual, 1e-12)), 1.0, kMaxExactness);
}

/// Tags with many inconsistent observations, sorted by their number in descending order.
std::vector<PoseIndex> suspects(const LapBundle& lap, double outlier_chi2) {
  constexpr int kMinContradictions = 8;
  constexpr std::size_t kMaxSuspects = 3;
  const std::vector<double> chi2 = corner_chi2(lap.bundle);
  std::map<PoseIndex, int> contradictions;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    if (!(chi2[i] < outlier_chi2)) ++contradictions[lap.bundle.corners[i].tag];
  }
  std::vector<PoseIndex> tags;
  for (const auto& [tag, count] : contradictions) {
    if (count >= kMinContradictions && !lap.is_held(tag)) tags.push_back(tag);
  }
  std::ranges::stable_sort(tags, std::greater<>{}, [&](PoseIndex tag) { return contradictions[tag]; });
  tags.resize(std::min(tags.size(), kMaxSuspects));
  return tags;
}

}  // namespace

void repair_trajectory_jumps(const LapInput& input, const BundleMapOptions& options,
                             const BundleOptions& search, const BundleProgress& progress, LapBundle& lap,
                             BundleSummary& summary) {
  const double exactness = exactness_beside_a_jump(lap.bundle);
  if (exactness <= 1) return;
  const LapBundle before = lap;
  for (const PoseIndex suspect : suspects(before, options.search.outlier_chi2)) {
    LapBundle again = before;
    for (CornerTerm& term : again.bundle.corners) term.used = term.tag != suspect && !term.unconfirmed;
    for (OdometryTerm& term : again.bundle.odometry) term.factor.whitening *= exactness;
    if (!solve(again.bundle, search, progress).usable()) continue;
    again.bundle.odometry = before.bundle.odometry;
    reinitialise_lost_tags(input, options, again);
    for (CornerTerm& term : again.bundle.corners) term.used = !term.unconfirmed;
    const BundleSummary other = solve(again.bundle, search, progress);
    if (!other.usable() || other.final_cost >= summary.final_cost || other.invisible > summary.invisible)
      continue;
    lap = std::move(again);
    summary = other;
    if (exactness_beside_a_jump(lap.bundle) <= 1) return;
  }
}

}  // namespace waymark::internal
