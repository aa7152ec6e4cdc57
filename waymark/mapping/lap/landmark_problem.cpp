#include "waymark/mapping/lap/landmark_problem.hpp"

#include <array>
#include <cmath>

#include "waymark/mapping/solver/front_cholesky.hpp"
#include "waymark/mapping/solver/levenberg_marquardt.hpp"

namespace waymark::internal {
namespace {

using Part = BlockSystem::Part;

double add_observation(const LandmarkProblem& p, const PointObservation& seen, double robust_chi2,
                       BlockSystem* system) {
  PlanarPointJacobians J;
  const Eigen::Vector2d r = planar_point_residual(seen.factor, p.frames[seen.frame], p.points[seen.point],
                                                  p.mounting, system != nullptr ? &J : nullptr);
  const double chi2 = r.squaredNorm();
  const bool robust = robust_chi2 > 0;
  if (system != nullptr) {
    system->add(std::array<Part, 3>{{{p.of_frame(seen.frame), J.base},
                                     {p.of_point(seen.point), J.point},
                                     {p.of_mounting(), J.mounting}}},
                r, robust ? 1 / (1 + chi2 / robust_chi2) : 1);
  }
  return (robust ? robust_chi2 * std::log1p(chi2 / robust_chi2) : chi2) / 2;
}

double add_motion(const LandmarkProblem& p, const PlaneMotion& motion, BlockSystem* system) {
  PlanarMotionJacobians J;
  const Eigen::Vector3d r =
      planar_motion_residual(motion.factor, p.frames[motion.to - 1], p.frames[motion.to], p.scales,
                             system != nullptr ? &J : nullptr);
  if (system != nullptr) {
    system->add(
        std::array<Part, 3>{
            {{p.of_frame(motion.to - 1), J.a}, {p.of_frame(motion.to), J.b}, {p.of_scales(), J.scales}}},
        r);
  }
  return r.squaredNorm() / 2;
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

/// What a step changes.
struct Values {
  std::vector<Eigen::Vector3d> frames;
  std::vector<Eigen::Vector2d> points;
  Eigen::Vector2d scales;
  Eigen::Vector3d mounting;
};

class LandmarkSearch {
 public:
  LandmarkSearch(LandmarkProblem& problem, double robust_chi2)
      : problem_(problem),
        robust_chi2_(robust_chi2),
        system_(system_of(problem)),
        plan_(front_plan(system_)),
        cholesky_(system_, plan_) {}
  LandmarkSearch(const LandmarkSearch&) = delete;  // its parts refer to each other
  LandmarkSearch& operator=(const LandmarkSearch&) = delete;

  double linearize() { return accumulate(problem_, robust_chi2_, &system_); }
  [[nodiscard]] double cost() const { return accumulate(problem_, robust_chi2_, nullptr); }
  [[nodiscard]] const Eigen::VectorXd& gradient() const { return system_.gradient(); }
  std::optional<Eigen::VectorXd> damped_step(double damping) {
    return internal::damped_step(cholesky_, system_, damping);
  }
  void retract(const Eigen::VectorXd& step) {
    LandmarkProblem& p = problem_;
    for (std::size_t i = 1; i < p.frames.size(); ++i)
      p.frames[i] += step.segment<3>(system_.offset(p.of_frame(i)));
    for (std::size_t i = 0; i < p.points.size(); ++i)
      p.points[i] += step.segment<2>(system_.offset(p.of_point(i)));
    p.scales += step.segment<2>(system_.offset(p.of_scales()));
    p.mounting += step.segment<3>(system_.offset(p.of_mounting()));
  }
  [[nodiscard]] Values values() const {
    return {problem_.frames, problem_.points, problem_.scales, problem_.mounting};
  }
  void restore(const Values& values) {
    problem_.frames = values.frames;
    problem_.points = values.points;
    problem_.scales = values.scales;
    problem_.mounting = values.mounting;
  }

 private:
  LandmarkProblem& problem_;
  double robust_chi2_;
  BlockSystem system_;
  FrontPlan plan_;
  FrontCholesky cholesky_;
};

}  // namespace

Eigen::Vector2d observation_residual(const LandmarkProblem& p, const PointObservation& seen) {
  return planar_point_residual(seen.factor, p.frames[seen.frame], p.points[seen.point], p.mounting);
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
  LandmarkSearch search(problem, robust_chi2);
  const auto end = levenberg_marquardt(search, search.linearize(),
                                       {.max_iterations = max_iterations, .relative_gain = 1e-8},
                                       [](int, double) { return true; });
  return {end.iterations, end.converged || end.exhausted};
}

}  // namespace waymark::internal
