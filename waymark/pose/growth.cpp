#include "waymark/pose/growth.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace waymark::internal {
namespace {

/// A tag that does not fit to first order is tried in earnest if a first-order step explains all but this
/// part of its chi2.
constexpr double kUnexplained = 0.25;
/// How often a tag may be sent away and come back when the others have changed.
constexpr int kMostExpulsions = 2;
/// The map's uncertainty is linearised again when the pose has moved by this many standard deviations, this
/// often at most.
constexpr double kMovedSigmas = 0.1;
constexpr int kMostLinearisations = 4;

}  // namespace

bool Growth::may_join(std::size_t i) const {
  return !tags_[i].is_member && fits_[i].visible && tags_[i].expulsions < kMostExpulsions;
}

void Growth::set_member(std::size_t i, bool is_member) {
  tags_[i].is_member = is_member;
  for (Tag& tag : tags_) tag.tried = false;
}

void Growth::evaluate(const Candidate& candidate, const SE3& cam_T_map, TagFit& fit) const {
  const Eigen::Matrix3d R = cam_T_map.rotation().matrix();
  Corners3 cam_corners;
  for (std::size_t i = 0; i < 4; ++i) cam_corners[i] = R * candidate.map_corners[i] + cam_T_map.translation();
  Vector8 e;
  Matrix86 J;
  fit.normal = NormalEquations();
  fit.visible = corner_residuals(camera_, cam_corners, pivot_of(cam_T_map), candidate.seen->corners_px, e, J);
  if (!fit.visible) return;
  fit.worst_corner_chi2 = candidate.whitening.worst_corner_chi2(e);
  candidate.whitening.apply(e, J);
  fit.normal.add(e, J);
}

/// False when a member cannot be seen from there.
bool Growth::evaluate_members(const SE3& cam_T_map) {
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (!tags_[i].is_member) continue;
    evaluate(candidates_[i], cam_T_map, fits_[i]);
    if (!fits_[i].visible) return false;
  }
  return true;
}

void Growth::evaluate_others(const SE3& cam_T_map) {
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (!tags_[i].is_member) evaluate(candidates_[i], cam_T_map, fits_[i]);
  }
}

std::optional<SE3> Growth::refine_alone(std::size_t seed, const SE3& start) const {
  const auto add_seed = [&](const SE3& cam_T_map, const Eigen::Vector3d&, NormalEquations& normal) {
    TagFit fit;
    evaluate(candidates_[seed], cam_T_map, fit);
    normal = fit.normal;
    return fit.visible;
  };
  const auto pivot = [this](const SE3& cam_T_map) { return pivot_of(cam_T_map); };
  const auto refined = refine(start, options_.max_iterations, pivot, add_seed);
  if (!refined || !(refined->normal.chi2 <= options_.tag_gate_chi2)) return std::nullopt;
  return refined->cam_T_ref;
}

/// The Gauss-Newton step of the members.
std::optional<Growth::Solved> Growth::solve() const {
  Solved solved;
  for (std::size_t i = 0; i < tags_.size(); ++i) {
    if (tags_[i].is_member) solved.sum.add(fits_[i].normal);
  }
  const std::optional<Cholesky6> cholesky = Cholesky6::of(solved.sum.H);
  if (!cholesky) return std::nullopt;
  solved.xi = -cholesky->solve(solved.sum.g);
  return solved;
}

/// Takes the members to their minimum; on the way others may join. False when they have none that can be
/// seen.
bool Growth::settle(SE3& cam_T_map, bool others_may_join) {
  for (int step = 0; step < options_.max_iterations; ++step) {
    if (!evaluate_members(cam_T_map)) return false;
    std::optional<Solved> solved = solve();
    if (!solved) return false;
    if (others_may_join) {
      evaluate_others(cam_T_map);
      if (let_join(*solved)) solved = solve();
      if (!solved) return false;
    }
    const double gain = -solved->xi.dot(solved->sum.g);
    cam_T_map = perturbed(solved->xi, cam_T_map, pivot_of(cam_T_map));
    if (gain <= kGainTolerance * (1e-3 + solved->sum.chi2)) return true;
  }
  return false;
}

/// Takes in every tag whose joining raises the total chi2, to first order, by no more than the gate: equation
/// (22).
bool Growth::let_join(const Solved& members) {
  bool joined = false;
  for (std::size_t i = 0; i < tags_.size(); ++i) {
    if (!may_join(i)) continue;
    const NormalEquations& tag = fits_[i].normal;
    const std::optional<Cholesky6> both = Cholesky6::of(members.sum.H + tag.H);
    if (!both) continue;
    const Vector6 g = members.sum.g + tag.g;
    const double rise = tag.chi2 - members.sum.g.dot(members.xi) - g.dot(both->solve(g));
    tags_[i].unexplained = rise / tag.chi2;
    if (rise <= options_.tag_gate_chi2) {
      set_member(i, true);
      joined = true;
    }
  }
  return joined;
}

/// Where a first-order prediction is not enough, because the members leave the pose uncertain: fits the
/// members with one more tag, the most promising first, until one fits with all of them.
bool Growth::try_to_join(SE3& cam_T_map) {
  while (true) {
    std::size_t best = tags_.size();
    double least = kUnexplained;
    for (std::size_t i = 0; i < tags_.size(); ++i) {
      if (!may_join(i) || tags_[i].tried || !(tags_[i].unexplained < least)) continue;
      best = i;
      least = tags_[i].unexplained;
    }
    if (best == tags_.size()) return false;
    if (try_one(best, cam_T_map)) return true;
  }
}

bool Growth::try_one(std::size_t i, SE3& cam_T_map) {
  SE3 trial = cam_T_map;
  tags_[i].is_member = true;
  bool fits = settle(trial, false);
  for (std::size_t k = 0; k < tags_.size() && fits; ++k) fits = !tags_[k].is_member || excess(k) <= 1;
  if (fits) {
    set_member(i, true);
    cam_T_map = trial;
    return true;
  }
  tags_[i].is_member = false;
  tags_[i].tried = true;
  // The members' equations are those of the trial.
  [[maybe_unused]] const bool visible = evaluate_members(cam_T_map);
  assert(visible);
  return false;
}

/// How far beyond its gates a tag is: more than 1 is outside.
double Growth::excess(std::size_t i) const {
  return std::max(fits_[i].normal.chi2 / options_.tag_gate_chi2,
                  fits_[i].worst_corner_chi2 / options_.corner_gate_chi2);
}

/// Sends away the member farthest beyond its gates; false when all are within.
bool Growth::expel_worst() {
  std::size_t worst = tags_.size();
  double worst_excess = 1.0;
  for (std::size_t i = 0; i < tags_.size(); ++i) {
    if (!tags_[i].is_member || !(excess(i) > worst_excess)) continue;
    worst = i;
    worst_excess = excess(i);
  }
  if (worst == tags_.size()) return false;
  set_member(worst, false);
  ++tags_[worst].expulsions;
  return true;
}

/// Adds what the uncertainty of a mapped tag does to its corners, equation (21), seen from this pose.
void Growth::linearise_map(const SE3& cam_T_map) {
  if (!map_is_uncertain_) return;
  ++linearisations_;
  linearised_at_ = cam_T_map;
  const Eigen::Matrix3d R = cam_T_map.rotation().matrix();
  for (Candidate& candidate : candidates_) {
    if (!candidate.mapped->covariance) continue;
    Matrix86 J_px_tag;
    bool visible = true;
    for (std::size_t i = 0; i < 4 && visible; ++i) {
      Matrix23 J_px_p;
      visible = camera_.project(cam_T_map * candidate.map_corners[i], &J_px_p).has_value();
      const Matrix23 J_px_map = J_px_p * R;
      J_px_tag.middleRows<2>(static_cast<Eigen::Index>(2 * i)) << J_px_map,
          -J_px_map * SO3::hat(candidate.map_corners[i]);
    }
    if (!visible) continue;
    const CornerCovariance corners = candidate.seen->corner_covariance_px2.value_or(
        CornerCovariance::Identity() * options_.corner_sigma_px * options_.corner_sigma_px);
    const auto whitening =
        Whitening::of(corners + J_px_tag * *candidate.mapped->covariance * J_px_tag.transpose());
    if (whitening) candidate.whitening = *whitening;
  }
}

std::optional<Consensus> Growth::finish(const SE3& cam_T_map) const {
  Consensus consensus{.cam_T_map = cam_T_map, .members = std::vector<char>(tags_.size(), 0), .fits = fits_};
  NormalEquations sum;
  for (std::size_t i = 0; i < tags_.size(); ++i) {
    if (!tags_[i].is_member) continue;
    sum.add(fits_[i].normal);
    consensus.members[i] = 1;
    ++consensus.count;
  }
  const std::optional<Cholesky6> information = Cholesky6::of(sum.H);
  if (consensus.count == 0 || !information) return std::nullopt;
  const Matrix6 Ad = shift_adjoint(pivot_of(cam_T_map));
  consensus.covariance = Ad * information->inverse() * Ad.transpose();
  consensus.chi2 = sum.chi2;
  return consensus;
}

/// Linearises the map's uncertainty here if the pose has moved noticeably since last time.
bool Growth::linearise_map_again(const SE3& cam_T_map) {
  if (!map_is_uncertain_ || linearisations_ >= kMostLinearisations) return false;
  const std::optional<Solved> solved = solve();
  Vector6 moved;
  moved << pivot_of(cam_T_map) - pivot_of(linearised_at_),
      (cam_T_map.rotation() * linearised_at_.rotation().inverse()).log();
  if (!solved || moved.dot(solved->sum.H * moved) < kMovedSigmas * kMovedSigmas) return false;
  linearise_map(cam_T_map);
  return true;
}

std::optional<Consensus> Growth::search(std::size_t seed, const SE3& start, bool others_may_join) {
  map_pivot_ = candidates_[seed].mapped->map_T_tag.translation();
  linearisations_ = 0;
  linearise_map(start);
  const std::optional<SE3> seed_only = refine_alone(seed, start);
  if (!seed_only) return std::nullopt;
  SE3 cam_T_map = *seed_only;
  tags_.assign(tags_.size(), Tag());
  tags_[seed].is_member = true;
  // Each tag joins and leaves a bounded number of times; the bound on rounds only guards against a mistake in
  // that.
  for (std::size_t rounds = 0; rounds < 10 + 4 * tags_.size(); ++rounds) {
    if (!settle(cam_T_map, others_may_join)) return std::nullopt;
    if (expel_worst()) continue;
    if (others_may_join && try_to_join(cam_T_map)) continue;
    if (linearise_map_again(cam_T_map)) continue;
    evaluate_others(cam_T_map);
    return finish(cam_T_map);
  }
  return std::nullopt;
}

}  // namespace waymark::internal
