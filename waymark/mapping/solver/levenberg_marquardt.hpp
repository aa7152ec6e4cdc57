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
  double damping = 1e-9;        ///< of the first step
  bool shortens = true;         ///< a step that went too far is tried shorter before it is damped more
  bool watches = false;         ///< and before that, a step from where it went
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

/// The cost after one more step from where one led that alone gains nothing, where the two together do: ways
/// that swing as a whole, which hardly anything keeps them from, bend what neighbours measured of each other
/// to the second order, and the next step puts just that right; shortened, such steps would come by the dozen
/// (Chamberlain, Powell, Lemarechal and Pedersen, "The watchdog technique for forcing convergence in
/// algorithms for constrained optimization", Mathematical Programming Studies 16, 1982). Nothing where the
/// two do not gain; then the problem stands somewhere else.
template <LeastSquares Problem>
std::optional<double> second_step(Problem& problem, double damping, double cost, double cost_between) {
  constexpr double kFar = 2;
  if (!(cost_between <= kFar * cost)) return std::nullopt;
  const std::optional<Eigen::VectorXd> step = problem.damped_step(damping);
  if (!step) return std::nullopt;
  problem.retract(*step);
  const double after = problem.linearize();
  if (!(after < cost)) return std::nullopt;
  return after;
}

/// The damping from step to step. Long chains of poses, and numbers that many of them share, are determined
/// by differences: with n poses along a way the smallest eigenvalue of H is n^-4 of its diagonal, and what is
/// more than that keeps them from going where they belong in one step. So it vanishes soon where steps gain
/// what they promise, and comes back in ever larger strides where they do not (Nielsen, "Damping Parameter in
/// Marquardt's Method", 1999).
class Damping {
 public:
  explicit Damping(double first) : damping_(first) {}
  [[nodiscard]] double value() const { return damping_; }
  [[nodiscard]] bool exhausted() const { return damping_ >= kMaxDamping; }

  void after_gain(double gained, double promised) {
    constexpr double kAsPromised = 0.9;
    constexpr double kHardly = 0.25;
    stride_ = kStride;
    if (gained > kAsPromised * promised)
      damping_ /= kStride * kStride * kStride;
    else if (gained > kHardly * promised)
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

/// Minimises the cost from where a linearised problem stands (Levenberg, "A method for the solution of
/// certain non-linear problems in least squares", 1944; Marquardt, "An algorithm for least-squares estimation
/// of nonlinear parameters", 1963). `cost` is what linearize() gave there, `goes_on(iteration, cost)` is
/// asked before each step. The normal equations afterwards need not be those of where it ends.
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
    // Nearly every step is a good one, so its normal equations are summed up at once.
    const double next = problem.linearize();
    // A step that should gain next to nothing and does not: rounding is all that is left.
    const bool rounding = promised <= 1e-12 * (1e-9 + end.cost);
    std::optional<double> reached;
    if (next <= end.cost)
      reached = next;
    else if (options.watches && !rounding)
      reached = second_step(problem, damping.value(), end.cost, next);
    if (reached) {
      end.converged = end.cost - *reached <= options.relative_gain * (end.cost + options.cost_floor);
      damping.after_gain(end.cost - *reached, promised);
      end.cost = *reached;
      continue;
    }
    problem.restore(before);  // also when it cannot be evaluated there
    end.converged = rounding;
    if (end.converged) break;
    if (!options.shortens || !shorten_step(problem, *step, end.cost)) damping.after_failure();
    end.cost = problem.linearize();
  }
  end.exhausted = damping.exhausted();
  return end;
}

}  // namespace waymark::internal
