#include "waymark/mapping/lap/landmark_problem.hpp"

#include <array>
#include <cmath>

#include "waymark/mapping/optimization/front_cholesky.hpp"

namespace waymark::internal {
namespace {

using Part = BlockSystem::Part;

Eigen::Matrix2d rotation(double angle) { return Eigen::Rotation2Dd(angle).toRotationMatrix(); }
/// d R(a)^T v / d a = -S R(a)^T v.
Eigen::Vector2d turned_back(const Eigen::Vector2d& v) { return {v.y(), -v.x()}; }

Eigen::Vector3d scaled_motion(const SE2::Tangent& twist, const Eigen::Vector2d& scales) {
  const SE2 motion = SE2::exp({scales.x() * twist.x(), scales.x() * twist.y(), scales.y() * twist.z()});
  return {motion.x(), motion.y(), scales.y() * twist.z()};
}

double add_observation(const LandmarkProblem& p, const PointObservation& seen, double robust_chi2,
                       BlockSystem* system) {
  const Eigen::Vector2d r = observation_residual(p, seen);
  const double chi2 = r.squaredNorm();
  const bool robust = robust_chi2 > 0;
  if (system != nullptr) {
    const Eigen::Vector3d& x = p.frames[seen.frame];
    const Eigen::Matrix2d Rt = rotation(x.z()).transpose();
    const Eigen::Vector2d there = Rt * (p.points[seen.point] - x.head<2>());
    Eigen::MatrixXd J_frame(2, 3);
    J_frame << -seen.whitening * Rt, seen.whitening * turned_back(there);
    const Eigen::MatrixXd J_point = seen.whitening * Rt;
    const Eigen::Vector2d mounted = rotation(p.mounting.z()) * seen.base_p;
    Eigen::MatrixXd J_mounting(2, 3);
    J_mounting << -seen.whitening, -seen.whitening * Eigen::Vector2d(-mounted.y(), mounted.x());
    system->add(std::array<Part, 3>{{{p.of_frame(seen.frame), J_frame},
                                     {p.of_point(seen.point), J_point},
                                     {p.of_mounting(), J_mounting}}},
                r, robust ? 1 / (1 + chi2 / robust_chi2) : 1);
  }
  return (robust ? robust_chi2 * std::log1p(chi2 / robust_chi2) : chi2) / 2;
}

double add_motion(const LandmarkProblem& p, const PlaneMotion& motion, BlockSystem* system) {
  const Eigen::Vector3d& a = p.frames[motion.to - 1];
  const Eigen::Vector3d& b = p.frames[motion.to];
  const Eigen::Matrix2d Rt = rotation(a.z()).transpose();
  const Eigen::Vector2d gone = Rt * (b.head<2>() - a.head<2>());
  Eigen::Vector3d r(gone.x(), gone.y(), b.z() - a.z());
  r -= scaled_motion(motion.twist, p.scales);
  const Eigen::Vector3d whitened = motion.inverse_sigma.cwiseProduct(r);
  if (system != nullptr) {
    const auto W = motion.inverse_sigma.asDiagonal();
    Eigen::Matrix3d J_a = Eigen::Matrix3d::Zero();
    J_a.topLeftCorner<2, 2>() = -Rt;
    J_a.topRightCorner<2, 1>() = turned_back(gone);
    J_a(2, 2) = -1;
    Eigen::Matrix3d J_b = Eigen::Matrix3d::Zero();
    J_b.topLeftCorner<2, 2>() = Rt;
    J_b(2, 2) = 1;
    constexpr double kStep = 1e-6;
    Eigen::MatrixXd J_scales(3, 2);
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(i);
      J_scales.col(i) =
          (scaled_motion(motion.twist, p.scales - step) - scaled_motion(motion.twist, p.scales + step)) /
          (2 * kStep);
    }
    const Eigen::MatrixXd A = W * J_a;
    const Eigen::MatrixXd B = W * J_b;
    const Eigen::MatrixXd S = W * J_scales;
    system->add(
        std::array<Part, 3>{{{p.of_frame(motion.to - 1), A}, {p.of_frame(motion.to), B}, {p.of_scales(), S}}},
        whitened);
  }
  return whitened.squaredNorm() / 2;
}

double add_priors(const LandmarkProblem& p, BlockSystem* system) {
  const Eigen::Vector2d scales = (p.scales - Eigen::Vector2d::Ones()).cwiseQuotient(p.scales_sigma);
  const Eigen::Vector3d mounting = p.mounting.cwiseQuotient(p.mounting_sigma);
  if (system != nullptr) {
    const Eigen::MatrixXd J_scales = p.scales_sigma.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd J_mounting = p.mounting_sigma.cwiseInverse().asDiagonal();
    system->add(std::array<Part, 1>{{{p.of_scales(), J_scales}}}, scales);
    system->add(std::array<Part, 1>{{{p.of_mounting(), J_mounting}}}, mounting);
  }
  return (scales.squaredNorm() + mounting.squaredNorm()) / 2;
}

void apply(const BlockSystem& system, const Eigen::VectorXd& step, LandmarkProblem& p) {
  for (std::size_t i = 1; i < p.frames.size(); ++i)
    p.frames[i] += step.segment<3>(system.offset(p.of_frame(i)));
  for (std::size_t i = 0; i < p.points.size(); ++i)
    p.points[i] += step.segment<2>(system.offset(p.of_point(i)));
  p.scales += step.segment<2>(system.offset(p.of_scales()));
  p.mounting += step.segment<3>(system.offset(p.of_mounting()));
}

}  // namespace

Eigen::Vector2d observation_residual(const LandmarkProblem& p, const PointObservation& seen) {
  const Eigen::Vector3d& x = p.frames[seen.frame];
  const Eigen::Vector2d there = rotation(x.z()).transpose() * (p.points[seen.point] - x.head<2>());
  return seen.whitening * (there - (rotation(p.mounting.z()) * seen.base_p + p.mounting.head<2>()));
}

BlockSystem system_of(const LandmarkProblem& p) {
  std::vector<int> dimensions(p.frames.size() - 1, 3);
  dimensions.insert(dimensions.end(), p.points.size(), 2);
  dimensions.insert(dimensions.end(), {2, 3});
  std::vector<std::pair<int, int>> couplings;
  const auto couple = [&](int a, int b) {
    if (a >= 0 && b >= 0) couplings.emplace_back(a, b);
  };
  for (const PointObservation& seen : p.observations) {
    couple(p.of_frame(seen.frame), p.of_point(seen.point));
    couple(p.of_frame(seen.frame), p.of_mounting());
    couple(p.of_point(seen.point), p.of_mounting());
  }
  for (const PlaneMotion& motion : p.motions) {
    couple(p.of_frame(motion.to - 1), p.of_frame(motion.to));
    couple(p.of_frame(motion.to - 1), p.of_scales());
    couple(p.of_frame(motion.to), p.of_scales());
  }
  return {std::move(dimensions), std::move(couplings)};
}

double accumulate(const LandmarkProblem& problem, double robust_chi2, BlockSystem* system) {
  if (system != nullptr) system->clear();
  double cost = add_priors(problem, system);
  for (const PlaneMotion& motion : problem.motions) cost += add_motion(problem, motion, system);
  for (const PointObservation& seen : problem.observations) {
    if (seen.used) cost += add_observation(problem, seen, robust_chi2, system);
  }
  return cost;
}

std::pair<int, bool> solve(LandmarkProblem& problem, double robust_chi2, int max_iterations) {
  BlockSystem system = system_of(problem);
  double cost = accumulate(problem, robust_chi2, &system);
  const FrontPlan plan = front_plan(system);
  FrontCholesky cholesky(system, plan);
  double damping = 1e-6;
  for (int i = 1; i <= max_iterations; ++i) {
    const auto step = damped_step(cholesky, system, damping);
    LandmarkProblem next = problem;
    if (step) apply(system, *step, next);
    const double next_cost = step ? accumulate(next, robust_chi2, nullptr) : INFINITY;
    if (!(next_cost <= cost)) {
      damping *= 10;
      if (damping > 1e10) return {i, true};
      continue;
    }
    const bool converged = cost - next_cost <= 1e-8 * cost;
    problem = std::move(next);
    cost = accumulate(problem, robust_chi2, &system);
    if (converged) return {i, true};
    damping = std::max(damping / 10, 1e-12);
  }
  return {max_iterations, false};
}

}  // namespace waymark::internal
