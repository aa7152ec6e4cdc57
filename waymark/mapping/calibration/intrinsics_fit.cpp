#include "waymark/mapping/calibration/intrinsics_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace waymark::internal {
namespace {

using Vector8 = Eigen::Matrix<double, 8, 1>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// The camera and, for each of its numbers, one a little below and one a little above.
struct CameraBundle {
  CameraModel camera;
  std::vector<CameraModel> below{};
  std::vector<CameraModel> above{};
  std::vector<double> step{};
};

std::optional<CameraBundle> camera_bundle(const FitOptions& options, const Eigen::VectorXd& parameters) {
  const auto make = [&](const Eigen::VectorXd& p) {
    return camera_of(options.lens, p, options.width_px, options.height_px);
  };
  const auto camera = make(parameters);
  if (!camera) return std::nullopt;
  CameraBundle bundle{.camera = *camera};
  for (Eigen::Index i = 0; i < std::min<Eigen::Index>(options.free_parameters, parameters.size()); ++i) {
    constexpr double kRelative = 1e-6;
    const double h = kRelative * std::max(1.0, std::abs(parameters[i]));
    Eigen::VectorXd moved = parameters;
    moved[i] = parameters[i] - h;
    const auto below = make(moved);
    moved[i] = parameters[i] + h;
    const auto above = make(moved);
    if (!below || !above) return std::nullopt;
    bundle.below.push_back(*below);
    bundle.above.push_back(*above);
    bundle.step.push_back(h);
  }
  return bundle;
}

CornerPoses poses_of(const TargetTag& tag, const TargetView& view) {
  return {.map_T_rig = view.target_T_cam,
          .rig_T_cam = SE3(),
          .map_T_body = SE3(),
          .body_T_tag = tag.target_T_tag};
}

/// Huber's loss of a whole tag (Huber, "Robust Estimation of a Location Parameter", 1964) and its weight.
struct Loss {
  double cost = 0;
  double weight = 1;
};

Loss huber(double chi2, double sigma) {
  const double threshold = 8 * sigma * sigma;
  if (sigma <= 0 || chi2 <= threshold) return {chi2, 1};
  const double root = std::sqrt(threshold * chi2);
  return {2 * root - threshold, std::sqrt(threshold / chi2)};
}

/// One view's share of the normal equations: of the intrinsics (A, a), of its pose (C, c), and between them
/// (B).
struct ViewSystem {
  Eigen::MatrixXd A{};
  Eigen::VectorXd a{};
  Eigen::MatrixXd B{};
  Matrix6 C = Matrix6::Zero();
  Vector6 c = Vector6::Zero();
};

/// J_r_intrinsics by central differences; false when a corner leaves the lens on the way.
bool intrinsics_jacobian(const TargetTag& tag, const TargetView& view, const CameraBundle& cameras,
                         Eigen::Matrix<double, 8, Eigen::Dynamic>& J) {
  for (std::size_t i = 0; i < cameras.step.size(); ++i) {
    const auto below = corner_residual(tag.seen, cameras.below[i], poses_of(tag, view));
    const auto above = corner_residual(tag.seen, cameras.above[i], poses_of(tag, view));
    if (!below || !above) return false;
    J.col(static_cast<Eigen::Index>(i)) = (*above - *below) / (2 * cameras.step[i]);
  }
  return true;
}

std::optional<ViewSystem> linearize(const TargetView& view, const CameraBundle& cameras, double huber_sigma) {
  const auto n = static_cast<Eigen::Index>(cameras.step.size());
  ViewSystem system{
      .A = Eigen::MatrixXd::Zero(n, n), .a = Eigen::VectorXd::Zero(n), .B = Eigen::MatrixXd::Zero(n, 6)};
  Eigen::Matrix<double, 8, Eigen::Dynamic> J(8, n);
  for (const TargetTag& tag : view.tags) {
    if (!tag.used) continue;
    CornerJacobians pose;
    const auto r = corner_residual(tag.seen, cameras.camera, poses_of(tag, view), &pose);
    if (!r || !intrinsics_jacobian(tag, view, cameras, J)) return std::nullopt;
    const double weight = huber(r->squaredNorm(), huber_sigma).weight;
    system.A.noalias() += weight * J.transpose() * J;
    system.a.noalias() += weight * J.transpose() * *r;
    system.B.noalias() += weight * J.transpose() * pose.rig;
    system.C.noalias() += weight * pose.rig.transpose() * pose.rig;
    system.c.noalias() += weight * pose.rig.transpose() * *r;
  }
  return system;
}

std::optional<double> total_cost(const std::vector<TargetView>& views, const CameraModel& camera,
                                 double huber_sigma) {
  double cost = 0;
  for (const TargetView& view : views) {
    for (const TargetTag& tag : view.tags) {
      if (!tag.used) continue;
      const auto chi2 = tag_chi2(tag, view, camera);
      if (!chi2) return std::nullopt;
      cost += huber(*chi2, huber_sigma).cost;
    }
  }
  return cost;
}

template <class Matrix>
Matrix damped(Matrix m, double damping) {
  m.diagonal() *= 1 + damping;
  return m;
}

struct Step {
  Eigen::VectorXd parameters{};
  std::vector<Vector6> poses{};
  Eigen::MatrixXd reduced{};  ///< the Schur complement: information of the intrinsics
};

/// Eliminates the poses (Triggs et al., "Bundle Adjustment - A Modern Synthesis", section 6.1).
std::optional<Step> solve(const std::vector<ViewSystem>& systems, double damping) {
  const Eigen::Index n = systems.front().a.size();
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd s = Eigen::VectorXd::Zero(n);
  std::vector<Eigen::LLT<Matrix6>> factors;
  for (const ViewSystem& system : systems) {
    factors.emplace_back(damped(system.C, damping));
    if (factors.back().info() != Eigen::Success) return std::nullopt;
    S += damped(system.A, damping) - system.B * factors.back().solve(system.B.transpose());
    s += system.a - system.B * factors.back().solve(system.c);
  }
  Step step{.parameters = Eigen::VectorXd::Zero(n), .reduced = S};
  if (n > 0) {
    const Eigen::LDLT<Eigen::MatrixXd> factor(S);
    if (factor.info() != Eigen::Success || !factor.isPositive()) return std::nullopt;
    step.parameters = -factor.solve(s);
  }
  for (std::size_t i = 0; i < systems.size(); ++i)
    step.poses.push_back(-factors[i].solve(systems[i].c + systems[i].B.transpose() * step.parameters));
  return step.parameters.allFinite() ? std::optional(std::move(step)) : std::nullopt;
}

std::optional<std::vector<ViewSystem>> linearize_all(const std::vector<TargetView>& views,
                                                     const CameraBundle& cameras, double huber_sigma) {
  std::vector<ViewSystem> systems;
  for (const TargetView& view : views) {
    auto system = linearize(view, cameras, huber_sigma);
    if (!system) return std::nullopt;
    systems.push_back(std::move(*system));
  }
  return systems;
}

}  // namespace

std::optional<double> tag_chi2(const TargetTag& tag, const TargetView& view, const CameraModel& camera) {
  const auto r = corner_residual(tag.seen, camera, poses_of(tag, view));
  return r ? std::optional(r->squaredNorm()) : std::nullopt;
}

std::optional<IntrinsicsFit> fit_intrinsics(std::vector<TargetView>& views, const Eigen::VectorXd& parameters,
                                            const FitOptions& options) {
  constexpr double kEnough = 1e-7;  // relative change of the cost: nothing against its own spread
  constexpr double kMostDamping = 1e10;
  IntrinsicsFit fit{.parameters = parameters};
  auto cameras = camera_bundle(options, parameters);
  if (!cameras || views.empty()) return std::nullopt;
  auto cost = total_cost(views, cameras->camera, options.huber_sigma);
  auto systems = linearize_all(views, *cameras, options.huber_sigma);
  if (!cost || !systems) return std::nullopt;
  double damping = 1e-4;
  while (fit.iterations < options.max_iterations && damping < kMostDamping && !fit.converged) {
    ++fit.iterations;
    const auto step = solve(*systems, damping);
    std::vector<TargetView> moved = views;
    Eigen::VectorXd trial = fit.parameters;
    if (step) {
      trial.head(step->parameters.size()) += step->parameters;
      for (std::size_t i = 0; i < moved.size(); ++i)
        moved[i].target_T_cam = SE3::exp(step->poses[i]) * moved[i].target_T_cam;
    }
    auto trial_cameras = step ? camera_bundle(options, trial) : std::nullopt;
    const auto trial_cost =
        trial_cameras ? total_cost(moved, trial_cameras->camera, options.huber_sigma) : std::nullopt;
    auto trial_systems = trial_cost && *trial_cost <= *cost
                             ? linearize_all(moved, *trial_cameras, options.huber_sigma)
                             : std::nullopt;
    if (!trial_systems) {
      damping *= 10;
      continue;
    }
    fit.converged = *cost - *trial_cost <= kEnough * (1 + *cost);
    damping = std::max(1e-12, damping / 10);
    views = std::move(moved);
    fit.parameters = trial;
    cost = trial_cost;
    systems = std::move(trial_systems);
  }
  fit.converged = fit.converged || damping >= kMostDamping;
  fit.chi2 = *cost;
  if (const auto last = solve(*systems, 0)) fit.information = last->reduced;
  return fit;
}

}  // namespace waymark::internal
