#include "waymark/mapping/solver/kept_factor.hpp"

#include <algorithm>

namespace waymark::internal {
namespace {

/// Ends when one more step lowers the quadratic model by less than a share of its mean gain (Nash and Sofer,
/// "Assessing a search direction within a truncated-Newton method", Operations Research Letters 9(4), 1990),
/// or by next to nothing.
std::optional<Eigen::VectorXd> conjugate_gradients(const BlockSystem& system, double damping,
                                                   double next_to_nothing,
                                                   const FrontCholesky& preconditioner) {
  constexpr double kStays = 1e-12;  // what nothing determines stays where it is
  constexpr double kAccuracy = 1e-3;
  constexpr int kMost = 25;
  const auto H = system.lower().selfadjointView<Eigen::Lower>();
  const Eigen::VectorXd added = (damping * system.lower().diagonal()).array() + kStays;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(added.size());
  Eigen::VectorXd r = -system.gradient();
  Eigen::VectorXd z = preconditioner.solve(r);
  Eigen::VectorXd p = z;
  double rz = r.dot(z);
  double gained = 0;
  for (int i = 1; i <= kMost; ++i) {
    if (!(rz > 0)) return x;
    const Eigen::VectorXd Hp = H * p + added.cwiseProduct(p);
    const double curvature = p.dot(Hp);
    if (!(curvature > 0)) return std::nullopt;
    const double length = rz / curvature;
    x += length * p;
    r -= length * Hp;
    const double gain = length * rz / 2;
    gained += gain;
    if (i * gain <= std::max(kAccuracy * gained, next_to_nothing)) return x;
    z = preconditioner.solve(r);
    const double before = rz;
    rz = r.dot(z);
    p = z + (rz / before) * p;
  }
  return std::nullopt;
}

}  // namespace

KeptFactor::Factor::Factor(const BlockSystem& of)
    : system(of), plan(front_plan(system)), cholesky(system, plan) {}

bool KeptFactor::fits(const BlockSystem& system) const {
  if (!factor_ || factor_->system.unknowns() != system.unknowns()) return false;
  for (int u = 0; u < system.unknowns(); ++u) {
    if (factor_->system.dimension(u) != system.dimension(u)) return false;
  }
  return true;
}

std::optional<Eigen::VectorXd> KeptFactor::step(const BlockSystem& system, double damping,
                                                double next_to_nothing) {
  if (fits(system)) {
    std::optional<Eigen::VectorXd> found =
        conjugate_gradients(system, damping, next_to_nothing, factor_->cholesky);
    if (found && found->allFinite()) return found;
  }
  factor_.reset();
  factor_ = std::make_unique<Factor>(system);
  std::optional<Eigen::VectorXd> found = damped_step(factor_->cholesky, factor_->system, damping);
  if (!found) factor_.reset();
  return found;
}

bool worth_keeping(const FrontPlan& plan, const BlockSystem& system) {
  constexpr double kMuchMore = 1000;
  double work = 0;
  for (const FrontPlan::Front& front : plan.fronts)
    work += static_cast<double>(front.own_size) * static_cast<double>(front.size) *
            static_cast<double>(front.size);
  return work > kMuchMore * static_cast<double>(system.lower().nonZeros());
}

}  // namespace waymark::internal
