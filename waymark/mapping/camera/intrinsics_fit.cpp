#include "waymark/mapping/camera/intrinsics_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

#include "waymark/geometry/dense.hpp"
#include "waymark/mapping/solver/levenberg_marquardt.hpp"

namespace waymark::internal {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// The camera and, for each parameter, one camera with a slightly lower value and one with a slightly higher
/// value.
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

/// Huber's loss for a whole mark (Huber, "Robust Estimation of a Location Parameter", 1964) and its weight.
struct Loss {
  double cost = 0;
  double weight = 1;
};

Loss huber(double chi2, Eigen::Index numbers, double sigma) {
  const double threshold = static_cast<double>(numbers) * sigma * sigma;
  if (sigma <= 0 || chi2 <= threshold) return {chi2, 1};
  const double root = std::sqrt(threshold * chi2);
  return {2 * root - threshold, std::sqrt(threshold / chi2)};
}

/// The contribution of one view to the normal equations, with the intrinsics' part (A, a), the pose's part
/// (C, c), and the block between them (B).
struct ViewSystem {
  Eigen::MatrixXd A{};
  Eigen::VectorXd a{};
  Eigen::MatrixXd B{};
  Matrix6 C = Matrix6::Zero();
  Vector6 c = Vector6::Zero();
};

/// Whitened residual of a mark, projected minus observed, with its derivatives.
struct MarkSystem {
  MarkVector r{};
  Eigen::Matrix<double, Eigen::Dynamic, 6, 0, 8, 6> J_pose{};  ///< left perturbation of target_T_cam
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 8, Eigen::Dynamic>
      J_camera{};  ///< computed by central differences
};

/// The system of one mark; empty if a point does not project into the image.
std::optional<MarkSystem> linearize(const ViewMark& mark, const SE3& cam_T_target,
                                    const CameraBundle& cameras) {
  const auto points = camera_points(mark, cam_T_target);
  const Eigen::Index rows = mark.numbers();
  const auto n = static_cast<Eigen::Index>(cameras.step.size());
  MarkSystem system{.r = MarkVector(rows)};
  system.J_pose.resize(rows, 6);
  system.J_camera.resize(rows, n);
  const Eigen::Matrix3d cam_R_target = cam_T_target.rotation().matrix();
  for (Eigen::Index i = 0; 2 * i < rows; ++i) {
    const auto k = static_cast<std::size_t>(i);
    Matrix23 J_px_p;
    const auto px = cameras.camera.project(points.at(k), &J_px_p);
    if (!px) return std::nullopt;
    system.r.segment<2>(2 * i) = *px - mark.seen.seen_px[k];
    const Matrix23 J_px_target = J_px_p * cam_R_target;
    system.J_pose.block<2, 3>(2 * i, 0) = -J_px_target;
    system.J_pose.block<2, 3>(2 * i, 3) = J_px_target * SO3::hat(mark.seen.target_points_m[k]);
  }
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto k = static_cast<std::size_t>(j);
    const auto below = projected(mark, points, cameras.below[k]);
    const auto above = projected(mark, points, cameras.above[k]);
    if (!below || !above) return std::nullopt;
    system.J_camera.col(j) = (*above - *below) / (2 * cameras.step[k]);
  }
  system.r = mark.whitening * system.r;
  system.J_pose = mark.whitening * system.J_pose;
  system.J_camera = mark.whitening * system.J_camera;
  return system;
}

std::optional<ViewSystem> linearize(const TargetView& view, const CameraBundle& cameras, double huber_sigma) {
  const auto n = static_cast<Eigen::Index>(cameras.step.size());
  ViewSystem system{
      .A = Eigen::MatrixXd::Zero(n, n), .a = Eigen::VectorXd::Zero(n), .B = Eigen::MatrixXd::Zero(n, 6)};
  const SE3 cam_T_target = view.target_T_cam.inverse();
  for (const ViewMark& mark : view.marks) {
    if (!mark.used) continue;
    const auto one = linearize(mark, cam_T_target, cameras);
    if (!one) return std::nullopt;
    const double weight = huber(one->r.squaredNorm(), mark.numbers(), huber_sigma).weight;
    system.A.noalias() += weight * one->J_camera.transpose() * one->J_camera;
    system.a.noalias() += weight * one->J_camera.transpose() * one->r;
    system.B.noalias() += weight * one->J_camera.transpose() * one->J_pose;
    system.C.noalias() += weight * one->J_pose.transpose() * one->J_pose;
    system.c.noalias() += weight * one->J_pose.transpose() * one->r;
  }
  return system;
}

std::optional<double> total_cost(const std::vector<TargetView>& views, const CameraModel& camera,
                                 double huber_sigma) {
  double cost = 0;
  for (const TargetView& view : views) {
    for (const ViewMark& mark : view.marks) {
      if (!mark.used) continue;
      const auto chi2 = mark_chi2(mark, view, camera);
      if (!chi2) return std::nullopt;
      cost += huber(*chi2, mark.numbers(), huber_sigma).cost;
    }
  }
  return cost;
}

template <class Matrix>
Matrix damped(Matrix m, double damping) {
  m.diagonal() *= 1 + damping;
  return m;
}

/// Normal equations with the poses eliminated (Triggs et al., "Bundle Adjustment - A Modern Synthesis",
/// section 6.1).
struct Elimination {
  std::vector<Cholesky> poses{};
  Eigen::MatrixXd reduced{};  ///< the Schur complement, that is, the information of the intrinsics
  Eigen::VectorXd gradient{};
};

std::optional<Elimination> eliminate(const std::vector<ViewSystem>& systems, double damping) {
  const Eigen::Index n = systems.front().a.size();
  Elimination result{.reduced = Eigen::MatrixXd::Zero(n, n), .gradient = Eigen::VectorXd::Zero(n)};
  for (const ViewSystem& system : systems) {
    const auto& factor = result.poses.emplace_back(damped(system.C, damping));
    if (!factor.positive()) return std::nullopt;
    result.reduced += damped(system.A, damping) - product(system.B, factor.solve(system.B.transpose()));
    result.gradient += system.a - product(system.B, factor.solve(system.c));
  }
  return result;
}

/// The step in the intrinsics, followed by the step in the pose of each view.
std::optional<Eigen::VectorXd> step_of(const std::vector<ViewSystem>& systems, double damping) {
  const auto reduced = eliminate(systems, damping);
  if (!reduced) return std::nullopt;
  const Eigen::Index n = reduced->gradient.size();
  Eigen::VectorXd step(n + 6 * std::ssize(systems));
  if (n > 0) {
    const SymmetricSolution intrinsics = solve_symmetric(reduced->reduced, reduced->gradient);
    if (!intrinsics.positive) return std::nullopt;
    step.head(n) = -intrinsics.X.col(0);
  }
  for (std::size_t i = 0; i < systems.size(); ++i)
    step.segment<6>(n + 6 * static_cast<Eigen::Index>(i)) =
        -reduced->poses[i].solve(systems[i].c + transposed_product(systems[i].B, step.head(n)));
  return step.allFinite() ? std::optional(std::move(step)) : std::nullopt;
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

/// The values that a step changes.
struct Values {
  Eigen::VectorXd parameters;
  std::vector<SE3> target_T_cam;
};

class IntrinsicsSearch {
 public:
  IntrinsicsSearch(std::vector<TargetView>& views, const Eigen::VectorXd& parameters,
                   const FitOptions& options)
      : views_(views), parameters_(parameters), options_(options) {}

  double linearize() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const auto cameras = camera_bundle(options_, parameters_);
    if (!cameras) return kInfinity;
    const auto cost = total_cost(views_, cameras->camera, options_.huber_sigma);
    auto systems = cost ? linearize_all(views_, *cameras, options_.huber_sigma) : std::nullopt;
    if (!systems) return kInfinity;
    systems_ = std::move(*systems);
    gradient_ = gradient_of(systems_);
    return *cost / 2;
  }
  [[nodiscard]] double cost() const {
    const auto camera = camera_of(options_.lens, parameters_, options_.width_px, options_.height_px);
    const auto cost = camera ? total_cost(views_, *camera, options_.huber_sigma) : std::nullopt;
    return cost.value_or(std::numeric_limits<double>::infinity()) / 2;
  }
  [[nodiscard]] const Eigen::VectorXd& gradient() const { return gradient_; }
  [[nodiscard]] std::optional<Eigen::VectorXd> damped_step(double damping) const {
    return step_of(systems_, damping);
  }
  void retract(const Eigen::VectorXd& step) {
    const Eigen::Index n = systems_.front().a.size();
    parameters_.head(n) += step.head(n);
    for (std::size_t i = 0; i < views_.size(); ++i)
      views_[i].target_T_cam =
          SE3::exp(step.segment<6>(n + 6 * static_cast<Eigen::Index>(i))) * views_[i].target_T_cam;
  }
  [[nodiscard]] Values values() const {
    Values values{.parameters = parameters_, .target_T_cam = {}};
    for (const TargetView& view : views_) values.target_T_cam.push_back(view.target_T_cam);
    return values;
  }
  void restore(const Values& values) {
    parameters_ = values.parameters;
    for (std::size_t i = 0; i < views_.size(); ++i) views_[i].target_T_cam = values.target_T_cam[i];
  }
  /// The information of the parameters at their current values, with the poses eliminated; empty if it is not
  /// positive definite.
  [[nodiscard]] Eigen::MatrixXd information() {
    const bool found = std::isfinite(linearize()) && step_of(systems_, 0);
    const auto reduced = found ? eliminate(systems_, 0) : std::nullopt;
    return reduced ? reduced->reduced : Eigen::MatrixXd();
  }
  [[nodiscard]] const Eigen::VectorXd& parameters() const { return parameters_; }

 private:
  static Eigen::VectorXd gradient_of(const std::vector<ViewSystem>& systems) {
    const Eigen::Index n = systems.front().a.size();
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(n + 6 * std::ssize(systems));
    for (std::size_t i = 0; i < systems.size(); ++i) {
      gradient.head(n) += systems[i].a;
      gradient.segment<6>(n + 6 * static_cast<Eigen::Index>(i)) = systems[i].c;
    }
    return gradient;
  }

  std::vector<TargetView>& views_;
  Eigen::VectorXd parameters_;
  const FitOptions& options_;
  std::vector<ViewSystem> systems_{};
  Eigen::VectorXd gradient_{};
};

}  // namespace

std::optional<IntrinsicsFit> fit_intrinsics(std::vector<TargetView>& views, const Eigen::VectorXd& parameters,
                                            const FitOptions& options) {
  if (views.empty() || !options.goes_on()) return std::nullopt;
  IntrinsicsSearch search(views, parameters, options);
  const double start = search.linearize();
  if (!std::isfinite(start)) return std::nullopt;
  const auto end =
      levenberg_marquardt(search, start,
                          {.max_iterations = options.max_iterations,
                           .relative_gain = 1e-7,  // negligible compared with the random spread of the cost
                           .cost_floor = 0.5,
                           .damping = 1e-4,
                           .backtracks = false},
                          [&](int, double) { return options.goes_on(); });
  if (end.stopped) return std::nullopt;
  return IntrinsicsFit{.parameters = search.parameters(),
                       .information = search.information(),
                       .chi2 = 2 * end.cost,
                       .iterations = end.iterations,
                       .converged = end.converged || end.exhausted};
}

namespace {

MarkVector seen_of(const ViewMark& mark) {
  MarkVector px(mark.numbers());
  for (Eigen::Index i = 0; 2 * i < px.size(); ++i)
    px.segment<2>(2 * i) = mark.seen.seen_px[static_cast<std::size_t>(i)];
  return px;
}

}  // namespace

std::array<Eigen::Vector3d, 4> camera_points(const ViewMark& mark, const SE3& cam_T_target) {
  std::array<Eigen::Vector3d, 4> points{};
  for (std::size_t i = 0; i < mark.seen.target_points_m.size(); ++i)
    points.at(i) = cam_T_target * mark.seen.target_points_m[i];
  return points;
}

std::optional<MarkVector> projected(const ViewMark& mark, const std::array<Eigen::Vector3d, 4>& cam_points,
                                    const CameraModel& camera) {
  MarkVector px(mark.numbers());
  for (Eigen::Index i = 0; 2 * i < px.size(); ++i) {
    const auto one = camera.project(cam_points.at(static_cast<std::size_t>(i)));
    if (!one) return std::nullopt;
    px.segment<2>(2 * i) = *one;
  }
  return px;
}

Result<ViewMark> view_mark(TargetMark mark, double default_sigma_px) {
  ViewMark view{.seen = std::move(mark)};
  const Eigen::Index n = view.numbers();
  const TargetMark& seen = view.seen;
  const auto finite = [](const auto& point) { return point.allFinite(); };
  if (n < 2 || n > 8 || seen.seen_px.size() != seen.target_points_m.size() ||
      !std::ranges::all_of(seen.seen_px, finite) || !std::ranges::all_of(seen.target_points_m, finite))
    return fail(ErrorCode::InvalidArgument, "the corners of a target mark are not finite");
  if (seen.covariance_px2.size() == 0) {
    view.whitening = MarkMatrix::Identity(n, n) / default_sigma_px;
    return view;
  }
  const auto refused = [] {
    return fail(ErrorCode::InvalidArgument,
                "the corner covariance of a target mark is not positive definite");
  };
  if (seen.covariance_px2.rows() != n || seen.covariance_px2.cols() != n || !seen.covariance_px2.allFinite())
    return refused();
  const Cholesky factor(seen.covariance_px2);
  if (!factor.positive()) return refused();
  view.whitening = factor.whitening();
  return view;
}

std::optional<double> mark_chi2(const ViewMark& mark, const TargetView& view, const CameraModel& camera) {
  const auto px = projected(mark, camera_points(mark, view.target_T_cam.inverse()), camera);
  if (!px) return std::nullopt;
  return MarkVector(mark.whitening * (*px - seen_of(mark))).squaredNorm();
}

}  // namespace waymark::internal
