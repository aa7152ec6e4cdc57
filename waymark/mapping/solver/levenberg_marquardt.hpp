#pragma once

#include <algorithm>
#include <concepts>
#include <optional>

#include <Eigen/Core>

namespace waymark::internal {

/// A nonlinear least-squares problem together with the current values of its unknowns.
template <class P>
concept LeastSquares = requires(P& problem, const P& same, const Eigen::VectorXd& step, double number) {
  /// Computes the normal equations (H, g) at the current values. Returns the cost, which is infinite if it
  /// cannot be evaluated.
  { problem.linearize() } -> std::same_as<double>;
  { same.cost() } -> std::same_as<double>;
  /// The gradient g from the last linearisation.
  { same.gradient() } -> std::convertible_to<Eigen::VectorXd>;
  /// The step -(H + damping diag(H))^-1 g; empty if the matrix is not positive definite.
  { problem.damped_step(number) } -> std::same_as<std::optional<Eigen::VectorXd>>;
  /// Moves the unknowns by a step.
  problem.retract(step);
  /// values() contains everything that retract() changes.
  problem.restore(same.values());
};

struct LevenbergMarquardtOptions {
  int max_iterations = 100;
  double relative_gain = 1e-9;  ///< as a share of the cost; the search ends after a step that gains less
  double cost_floor = 1e-12;    ///< added to the cost before gains are compared with it
  double damping = 1e-9;        ///< damping for the first step
  bool backtracks = true;       ///< a step that raises the cost is shortened before the damping is increased
  bool watchdog = false;        ///< before it is shortened, a second step from its end point is tried
};

struct LevenbergMarquardtEnd {
  bool converged = false;
  bool exhausted = false;  ///< no step of any length reduces the cost, or no step could be computed
  bool stopped = false;    ///< stopped on request
  int iterations = 0;
  double cost = 0;
};

/// Halves a step that raised the cost until it reduces the cost. If no part of the step does, restores the
/// values and returns false.
template <LeastSquares Problem>
bool shorten_step(Problem& problem, const Eigen::VectorXd& step, double cost) {
  constexpr double kMinShare = 0.05;
  const auto before = problem.values();
  for (double share = 0.5; share > kMinShare; share /= 2) {
    problem.retract(share * step);
    if (problem.cost() < cost) return true;
    problem.restore(before);
  }
  return false;
}

/// The cost after a second step from the end point of a first step that raised the cost. Empty if the two
/// steps together do not reduce the cost; in that case, the values are undefined. A weakly constrained
/// trajectory that turns as a whole distorts the relative poses of neighbours to second order, and the second
/// step corrects exactly this. Without it, dozens of shortened steps would be needed (Chamberlain, Powell,
/// Lemarechal and Pedersen, "The watchdog technique for forcing convergence in algorithms for constrained
/// optimization", Mathematical Programming Studies 16, 1982).
template <LeastSquares Problem>
std::optional<double> second_step(Problem& problem, double damping, double cost, double cost_between) {
  constexpr double kMaxCostRatio = 2;
  if (!(cost_between <= kMaxCostRatio * cost)) return std::nullopt;
  const std::optional<Eigen::VectorXd> step = problem.damped_step(damping);
  if (!step) return std::nullopt;
  problem.retract(*step);
  const double after = problem.linearize();
  if (!(after < cost)) return std::nullopt;
  return after;
}

/// Adapts the damping from step to step. Long chains of poses, and parameters common to many poses, are
/// determined by small differences. With n poses along a trajectory, the smallest eigenvalue of H is n^-4
/// times its diagonal. Damping above that prevents convergence in a single step. The damping therefore
/// decreases quickly while steps gain what the model predicts, and increases by growing factors when they do
/// not (Nielsen, "Damping Parameter in Marquardt's Method", 1999).
class Damping {
 public:
  explicit Damping(double first) : damping_(first) {}
  [[nodiscard]] double value() const { return damping_; }
  [[nodiscard]] bool exhausted() const { return damping_ >= kMaxDamping; }

  void after_gain(double gained, double promised) {
    constexpr double kGoodShare = 0.9;
    constexpr double kFairShare = 0.25;
    stride_ = kStride;
    if (gained > kGoodShare * promised)
      damping_ /= kStride * kStride * kStride;
    else if (gained > kFairShare * promised)
      damping_ /= kStride;
    damping_ = std::max(damping_, kMinDamping);
  }
  void after_failure() {
    damping_ = std::max(damping_, kMinDamping) * stride_;
    stride_ *= kStride;
  }

 private:
  static constexpr double kStride = 10;
  static constexpr double kMinDamping = 1e-16;
  static constexpr double kMaxDamping = 1e12;

  double damping_;
  double stride_ = kStride;
};

/// Minimises the cost, starting from the current values of a linearised problem (Levenberg, "A method for the
/// solution of certain non-linear problems in least squares", 1944; Marquardt, "An algorithm for
/// least-squares estimation of nonlinear parameters", 1963). `cost`: the result of linearize() at these
/// values. `goes_on(iteration, cost)` is called before each step; the search ends if it returns false. After
/// the search, the normal equations may not be those at the final values.
template <LeastSquares Problem, std::predicate<int, double> GoesOn>
LevenbergMarquardtEnd levenberg_marquardt(Problem& problem, double cost,
                                          const LevenbergMarquardtOptions& options, const GoesOn& goes_on) {
  LevenbergMarquardtEnd end{.cost = cost};
  Damping damping(options.damping);
  while (end.iterations < options.max_iterations && !end.converged && !damping.exhausted()) {
    end.stopped = !goes_on(end.iterations, end.cost);
    if (end.stopped) break;
    ++end.iterations;
    const std::optional<Eigen::VectorXd> step = problem.damped_step(damping.value());
    if (!step) {
      damping.after_failure();
      continue;
    }
    const double promised = -step->dot(problem.gradient()) / 2;
    const auto before = problem.values();
    problem.retract(*step);
    // Most steps are accepted, so the normal equations are computed along with the cost.
    const double next = problem.linearize();
    // The predicted gain is below rounding error, and the cost did not decrease.
    const bool rounding = promised <= 1e-12 * (1e-9 + end.cost);
    std::optional<double> reached;
    if (next <= end.cost)
      reached = next;
    else if (options.watchdog && !rounding)
      reached = second_step(problem, damping.value(), end.cost, next);
    if (reached) {
      end.converged = end.cost - *reached <= options.relative_gain * (end.cost + options.cost_floor);
      damping.after_gain(end.cost - *reached, promised);
      end.cost = *reached;
      continue;
    }
    problem.restore(before);  // also if the cost is infinite at the new values
    end.converged = rounding;
    if (end.converged) break;
    if (!options.backtracks || !shorten_step(problem, *step, end.cost)) damping.after_failure();
    end.cost = problem.linearize();
  }
  end.exhausted = damping.exhausted();
  return end;
}

}  // namespace waymark::internal
