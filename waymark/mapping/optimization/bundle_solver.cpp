#include <algorithm>
#include <cmath>
#include <limits>

#include "waymark/mapping/optimization/bundle.hpp"
#include "waymark/mapping/optimization/bundle_terms.hpp"
#include "waymark/mapping/optimization/front_cholesky.hpp"
#include "waymark/mapping/optimization/kept_factor.hpp"
#include "waymark/mapping/optimization/schur_system.hpp"

namespace waymark {
namespace {

using internal::BlockSystem;
using internal::Unknowns;

std::optional<double> chi2_of(const Bundle& bundle, const CornerTerm& term) {
  const CornerPoses poses{bundle.poses[term.rig].value, bundle.poses[term.cam].value,
                          bundle.poses[term.body].value, bundle.poses[term.tag].value};
  const auto r = corner_residual(term.factor, bundle.cameras[term.camera], poses);
  if (!r) return std::nullopt;
  return r->squaredNorm();
}

int set_invisible_aside(Bundle& bundle) {
  int invisible = 0;
  for (CornerTerm& term : bundle.corners) {
    if (!term.used || chi2_of(bundle, term)) continue;
    term.used = false;
    ++invisible;
  }
  return invisible;
}

/// What a step changes, to take it back.
struct Values {
  std::vector<BundlePose> poses;
  std::vector<BundleScales> scales;

  static Values of(const Bundle& bundle) { return {bundle.poses, bundle.odometry_scales}; }
  void restore(Bundle& bundle) const {
    bundle.poses = poses;
    bundle.odometry_scales = scales;
  }
};

/// As BlockSystem::step(), by elimination.
std::optional<Eigen::VectorXd> step_of(internal::SchurSystem& schur, const BlockSystem& system,
                                       double damping) {
  constexpr double kStays = 1e-12;  // what nothing determines stays where it is
  if (!schur.factorize(damping, kStays)) return std::nullopt;
  Eigen::VectorXd step = schur.solve(-system.gradient());
  if (!step.allFinite()) return std::nullopt;
  return step;
}

/// Goes the way of a step that went too far as far as gains something: a half of it, a quarter, ... Stays
/// where it is when nothing of it does.
bool shorten(const Unknowns& unknowns, const BlockSystem& system, const Eigen::VectorXd& step,
             double robust_chi2, double cost, Bundle& bundle) {
  constexpr double kShortest = 0.05;
  const Values before = Values::of(bundle);
  for (double share = 0.5; share > kShortest; share /= 2) {
    internal::apply(unknowns, system, share * step, bundle);
    if (internal::accumulate(bundle, unknowns, robust_chi2, nullptr) < cost) return true;
    before.restore(bundle);
  }
  return false;
}

}  // namespace

BundleSummary solve(Bundle& bundle, const BundleOptions& options, const BundleProgress& progress) {
  internal::KeptFactor kept;
  return solve(bundle, options, progress, kept);
}

BundleSummary solve(Bundle& bundle, const BundleOptions& options, const BundleProgress& progress,
                    internal::KeptFactor& kept) {
  constexpr double kLeastDamping = 1e-12;
  constexpr double kMostDamping = 1e12;
  BundleSummary summary;
  const Unknowns unknowns = internal::unknowns_of(bundle);
  if (unknowns.dimensions.empty()) {
    summary.why = "nothing is unknown, or nothing was measured";
    return summary;
  }
  const internal::SchurPlan plan = internal::schur_plan(unknowns.dimensions, unknowns.couplings);
  BlockSystem system(unknowns.dimensions, unknowns.couplings);
  internal::SchurSystem schur(system, plan);
  const internal::FrontPlan fronts = plan.worth_it() ? internal::FrontPlan() : internal::front_plan(system);
  const bool keep = !plan.worth_it() && internal::worth_keeping(fronts, system);
  internal::FrontCholesky cholesky(system, fronts);
  double cost = internal::accumulate(bundle, unknowns, options.robust_chi2, &system);
  if (const int invisible = std::isfinite(cost) ? 0 : set_invisible_aside(bundle); invisible > 0) {
    summary = solve(bundle, options, progress, kept);
    summary.invisible += invisible;
    return summary;
  }
  summary.initial_cost = cost;
  double damping = 1e-6;
  while (summary.iterations < options.max_iterations && !summary.converged && damping < kMostDamping) {
    summary.stopped = progress && !progress(summary.iterations, cost);
    if (summary.stopped) break;
    ++summary.iterations;
    const auto step = plan.worth_it() ? step_of(schur, system, damping)
                      : keep          ? kept.step(system, damping)
                                      : internal::damped_step(cholesky, system, damping);
    const Values before = Values::of(bundle);
    if (step) internal::apply(unknowns, system, *step, bundle);
    const double promised = step ? -step->dot(system.gradient()) / 2 : 0;
    // Nearly every step is a good one, so its normal equations are summed up at once.
    const double next = step ? internal::accumulate(bundle, unknowns, options.robust_chi2, &system)
                             : std::numeric_limits<double>::infinity();
    if (!(next <= cost)) {  // also when it cannot be evaluated there
      before.restore(bundle);
      // A step that should gain next to nothing and does not: rounding is all that is left.
      summary.converged = step && promised <= 1e-12 * (1e-9 + cost);
      if (!step || summary.converged) {
        damping = std::max(damping, kLeastDamping) * 10;
        continue;
      }
      if (!shorten(unknowns, system, *step, options.robust_chi2, cost, bundle))
        damping = std::max(damping, kLeastDamping) * 10;
      cost = internal::accumulate(bundle, unknowns, options.robust_chi2, &system);
      continue;
    }
    summary.converged = cost - next <= options.relative_gain * (cost + 1e-12);
    damping = std::max(damping / 10, kLeastDamping);
    cost = next;
  }
  summary.final_cost = cost;
  if (!std::isfinite(cost)) summary.why = "the cost is not finite: a measurement or a start is not a number";
  return summary;
}

double cost(const Bundle& bundle) {
  const Unknowns unknowns = internal::unknowns_of(bundle);
  return internal::accumulate(bundle, unknowns, 0, nullptr);
}

std::vector<double> corner_chi2(const Bundle& bundle) {
  std::vector<double> chi2;
  chi2.reserve(bundle.corners.size());
  for (const CornerTerm& term : bundle.corners)
    chi2.push_back(chi2_of(bundle, term).value_or(std::numeric_limits<double>::infinity()));
  return chi2;
}

}  // namespace waymark
