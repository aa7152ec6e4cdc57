#pragma once

#include <algorithm>
#include <concepts>
#include <optional>

#include <Eigen/Core>

namespace waymark::internal {

/// A nonlinear least-squares problem that stands at some values of its unknowns.
template <class P>
concept LeastSquares = requires(P& problem, const P& same, const Eigen::VectorXd& step, double number) {
  /// Normal equations H, g where it stands; the cost there, infinite where it cannot be evaluated.
  { problem.linearize() } -> std::same_as<double>;
  { same.cost() } -> std::same_as<double>;
  /// g of the last linearisation.
  { same.gradient() } -> std::convertible_to<Eigen::VectorXd>;
  /// -(H + damping diag(H))^-1 g; nothing when that is not positive definite.
  { problem.damped_step(number) } -> std::same_as<std::optional<Eigen::VectorXd>>;
  /// Moves the unknowns by a step.
  problem.retract(step);
  /// What retract() changes.
  problem.restore(same.values());
};

struct LevenbergMarquardtOptions {
  int max_iterations = 100;
  double relative_gain = 1e-9;  ///< of the cost: a step that gains less is the last
  double cost_floor = 1e-12;    ///< added to the cost where gains are held against it
  double damping = 1e-6;        ///< of the first step
  bool shortens = true;         ///< a step that went too far is tried shorter before it is damped more
};

struct LevenbergMarquardtEnd {
  bool converged = false;
  bool exhausted = false;  ///< no step of any length gains anything, or none could be solved for
  bool stopped = false;    ///< on request
  int iterations = 0;
  double cost = 0;
};

/// Goes the way of a step that went too far as far as gains something: a half of it, a quarter, ... Stays
/// where it is when nothing of it does.
template <LeastSquares Problem>
bool shorten_step(Problem& problem, const Eigen::VectorXd& step, double cost) {
  constexpr double kShortest = 0.05;
  const auto before = problem.values();
  for (double share = 0.5; share > kShortest; share /= 2) {
    problem.retract(share * step);
    if (problem.cost() < cost) return true;
    problem.restore(before);
  }
  return false;
}

/// Minimises the cost from where a linearised problem stands (Levenberg, "A method for the solution of
/// certain non-linear problems in least squares", 1944; Marquardt, "An algorithm for least-squares estimation
/// of nonlinear parameters", 1963). `cost` is what linearize() gave there, `goes_on(iteration, cost)` is
/// asked before each step. The normal equations afterwards need not be those of where it ends.
template <LeastSquares Problem, std::predicate<int, double> GoesOn>
LevenbergMarquardtEnd levenberg_marquardt(Problem& problem, double cost,
                                          const LevenbergMarquardtOptions& options, const GoesOn& goes_on) {
  constexpr double kLeastDamping = 1e-12;
  constexpr double kMostDamping = 1e12;
  LevenbergMarquardtEnd end{.cost = cost};
  double damping = options.damping;
  const auto damp_more = [&] { damping = std::max(damping, kLeastDamping) * 10; };
  while (end.iterations < options.max_iterations && !end.converged && damping < kMostDamping) {
    end.stopped = !goes_on(end.iterations, end.cost);
    if (end.stopped) break;
    ++end.iterations;
    const std::optional<Eigen::VectorXd> step = problem.damped_step(damping);
    if (!step) {
      damp_more();
      continue;
    }
    const double promised = -step->dot(problem.gradient()) / 2;
    const auto before = problem.values();
    problem.retract(*step);
    // Nearly every step is a good one, so its normal equations are summed up at once.
    const double next = problem.linearize();
    if (next <= end.cost) {
      end.converged = end.cost - next <= options.relative_gain * (end.cost + options.cost_floor);
      damping = std::max(damping / 10, kLeastDamping);
      end.cost = next;
      continue;
    }
    problem.restore(before);  // also when it cannot be evaluated there
    // A step that should gain next to nothing and does not: rounding is all that is left.
    end.converged = promised <= 1e-12 * (1e-9 + end.cost);
    if (end.converged) break;
    if (!options.shortens || !shorten_step(problem, *step, end.cost)) damp_more();
    end.cost = problem.linearize();
  }
  end.exhausted = damping >= kMostDamping;
  return end;
}

}  // namespace waymark::internal
