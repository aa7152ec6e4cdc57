#include <cmath>
#include <limits>

#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/mapping/solver/bundle_terms.hpp"
#include "waymark/mapping/solver/front_cholesky.hpp"
#include "waymark/mapping/solver/kept_factor.hpp"
#include "waymark/mapping/solver/levenberg_marquardt.hpp"

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
  std::vector<CameraModel> cameras;
  std::vector<BundleIntrinsics> intrinsics;
};

/// A bundle as levenberg_marquardt() wants it: its normal equations, and their factorisation.
class BundleProblem {
 public:
  BundleProblem(Bundle& bundle, const Unknowns& unknowns, const BundleOptions& options,
                internal::KeptFactor& kept)
      : bundle_(bundle),
        unknowns_(unknowns),
        robust_chi2_(options.robust_chi2),
        relative_gain_(options.relative_gain),
        kept_(kept),
        system_(unknowns.dimensions, unknowns.couplings),
        fronts_(internal::front_plan(system_)),
        keeps_(internal::worth_keeping(fronts_, system_)),
        cholesky_(system_, fronts_) {}
  BundleProblem(const BundleProblem&) = delete;  // its parts refer to each other
  BundleProblem& operator=(const BundleProblem&) = delete;

  double linearize() { return cost_ = internal::accumulate(bundle_, unknowns_, robust_chi2_, &system_); }
  [[nodiscard]] double cost() const {
    return internal::accumulate(bundle_, unknowns_, robust_chi2_, nullptr);
  }
  [[nodiscard]] const Eigen::VectorXd& gradient() const { return system_.gradient(); }
  std::optional<Eigen::VectorXd> damped_step(double damping) {
    constexpr double kShare = 0.1;  // of the gain at which the search ends
    return keeps_ ? kept_.step(system_, damping, kShare * relative_gain_ * cost_)
                  : internal::damped_step(cholesky_, system_, damping);
  }
  void retract(const Eigen::VectorXd& step) { internal::apply(unknowns_, system_, step, bundle_); }
  [[nodiscard]] Values values() const {
    return {bundle_.poses, bundle_.odometry_scales, bundle_.cameras, bundle_.intrinsics};
  }
  void restore(const Values& values) {
    bundle_.poses = values.poses;
    bundle_.odometry_scales = values.scales;
    bundle_.cameras = values.cameras;
    bundle_.intrinsics = values.intrinsics;
  }

 private:
  Bundle& bundle_;
  const Unknowns& unknowns_;
  double robust_chi2_;
  double relative_gain_;
  double cost_ = 0;
  internal::KeptFactor& kept_;
  BlockSystem system_;
  internal::FrontPlan fronts_;
  bool keeps_;
  internal::FrontCholesky cholesky_;
};

}  // namespace

BundleSummary solve(Bundle& bundle, const BundleOptions& options, const BundleProgress& progress) {
  internal::KeptFactor kept;
  return solve(bundle, options, progress, kept);
}

BundleSummary solve(Bundle& bundle, const BundleOptions& options, const BundleProgress& progress,
                    internal::KeptFactor& kept) {
  BundleSummary summary;
  const Unknowns unknowns = internal::unknowns_of(bundle);
  if (unknowns.dimensions.empty()) {
    summary.why = "nothing is unknown, or nothing was measured";
    return summary;
  }
  BundleProblem problem(bundle, unknowns, options, kept);
  summary.initial_cost = problem.linearize();
  if (const int invisible = std::isfinite(summary.initial_cost) ? 0 : set_invisible_aside(bundle);
      invisible > 0) {
    summary = solve(bundle, options, progress, kept);
    summary.invisible += invisible;
    return summary;
  }
  const auto goes_on = [&](int iteration, double cost) { return !progress || progress(iteration, cost); };
  const auto end = internal::levenberg_marquardt(
      problem, summary.initial_cost,
      {.max_iterations = options.max_iterations, .relative_gain = options.relative_gain, .watches = true},
      goes_on);
  summary.converged = end.converged;
  summary.stopped = end.stopped;
  summary.iterations = end.iterations;
  summary.final_cost = end.cost;
  if (!std::isfinite(end.cost))
    summary.why = "the cost is not finite: a measurement or a start is not a number";
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
