#pragma once

#include <array>
#include <cmath>
#include <optional>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark::internal {

/// Cholesky factorisation A = L L^T of a symmetric 6x6 matrix, for the inner loop of pose refinement. Its
/// loops have constant bounds, so compilers unroll them. For this size, it takes a third of the time of
/// Eigen's LLT (benchmarks/pose_benchmark.cpp).
class Cholesky6 {
 public:
  using Vector = Eigen::Matrix<double, 6, 1>;
  using Matrix = Eigen::Matrix<double, 6, 6>;

  /// Returns `nullopt` if A is not positive definite or not finite. Reads only the lower triangle.
  static std::optional<Cholesky6> of(const Matrix& A) {
    Cholesky6 c;
    for (int j = 0; j < 6; ++j) {
      double pivot = A(j, j);
      for (int k = 0; k < j; ++k) pivot -= c.L_(j, k) * c.L_(j, k);
      // A pivot smaller than the rounding error of the subtraction carries no information.
      if (!(pivot > 1e-15 * A(j, j)) || !std::isfinite(pivot)) return std::nullopt;
      c.L_(j, j) = std::sqrt(pivot);
      c.inverse_diagonal_[j] = 1.0 / c.L_(j, j);
      for (int i = j + 1; i < 6; ++i) {
        double sum = A(i, j);
        for (int k = 0; k < j; ++k) sum -= c.L_(i, k) * c.L_(j, k);
        c.L_(i, j) = sum * c.inverse_diagonal_[j];
      }
    }
    return c;
  }

  [[nodiscard]] Vector solve(Vector b) const {
    for (int i = 0; i < 6; ++i) {
      for (int k = 0; k < i; ++k) b[i] -= L_(i, k) * b[k];
      b[i] *= inverse_diagonal_[i];
    }
    for (int i = 5; i >= 0; --i) {
      for (int k = i + 1; k < 6; ++k) b[i] -= L_(k, i) * b[k];
      b[i] *= inverse_diagonal_[i];
    }
    return b;
  }

  /// A^-1 = L^-T L^-1.
  [[nodiscard]] Matrix inverse() const {
    Matrix M = Matrix::Zero();  // L^-1
    for (int j = 0; j < 6; ++j) {
      M(j, j) = inverse_diagonal_[j];
      for (int i = j + 1; i < 6; ++i) {
        double sum = 0;
        for (int k = j; k < i; ++k) sum -= L_(i, k) * M(k, j);
        M(i, j) = sum * inverse_diagonal_[i];
      }
    }
    return M.transpose().lazyProduct(M);
  }

 private:
  Matrix L_;  ///< only the lower triangle is set
  Vector inverse_diagonal_;
};

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Vector8 = Eigen::Matrix<double, 8, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Matrix86 = Eigen::Matrix<double, 8, 6>;
using Corners3 = std::array<Eigen::Vector3d, 4>;
using Corners2 = std::array<Eigen::Vector2d, 4>;

/// Transforms the eight coordinates of a residual to independent coordinates with unit variance, using L^-1
/// for the covariance L L^T.
class Whitening {
 public:
  /// For independent coordinates with this standard deviation [px].
  explicit Whitening(double sigma_px = 1.0) : inverse_sigma_(1.0 / sigma_px) {}
  /// For a full covariance [px^2]; `nullopt` if it is not positive definite and finite.
  static std::optional<Whitening> of(const CornerCovariance& covariance_px2);

  void apply(Vector8& e, Matrix86& J) const;
  void apply(Vector8& e) const;
  /// Whitens the covariance of a residual: L^-1 C L^-T.
  void apply_to_covariance(CornerCovariance& C) const;
  /// Largest squared Mahalanobis distance of a single corner, with 2 degrees of freedom; `e` is the residual
  /// before whitening.
  [[nodiscard]] double worst_corner_chi2(const Vector8& e) const;

 private:
  [[nodiscard]] bool isotropic() const { return inverse_sigma_ > 0; }

  double inverse_sigma_ = 0;  ///< if 0, the full factor is used
  CornerCovariance factor_;   ///< the factor L, set only for a full covariance
};

/// Normal equations of a least squares problem at a pose: H = J^T J, g = J^T e, chi2 = e^T e, with whitened
/// residuals e.
struct NormalEquations {
  Matrix6 H = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  double chi2 = 0;

  void add(const Vector8& e, const Matrix86& J, double weight = 1.0);
  void add(const NormalEquations& other, double weight = 1.0) {
    H += weight * other.H;
    g += weight * other.g;
    chi2 += weight * other.chi2;
  }
};

/// Residuals (projection - measurement) of four corners and their derivatives, equations (13) and (14). The
/// derivatives are with respect to a left perturbation in the frame that has the camera's axes and its origin
/// at cam_pivot. Returns false, leaving e and J incomplete, if a corner is behind the camera or outside the
/// field of the lens.
bool corner_residuals(const CameraModel& camera, const Corners3& cam_corners,
                      const Eigen::Vector3d& cam_pivot, const Corners2& measured_px, Vector8& e, Matrix86& J);

/// J C J^T for the derivatives J of the residuals of four corners with respect to the camera parameters (see
/// intrinsics_of()) and their covariance C [px^2]. `nullopt` if a corner does not project.
std::optional<CornerCovariance> lens_residual_covariance(const CameraModel& camera,
                                                         const Corners3& cam_corners,
                                                         const IntrinsicsCovariance& intrinsics_covariance);

/// Applies exp(xi) to cam_T_ref in the frame that has the camera's axes and its origin at cam_pivot.
[[nodiscard]] inline SE3 perturbed(const Vector6& xi, const SE3& cam_T_ref,
                                   const Eigen::Vector3d& cam_pivot) {
  const SE3 step = SE3::exp(xi);
  return {step.rotation() * cam_T_ref.rotation(), cam_pivot + step * (cam_T_ref.translation() - cam_pivot)};
}

/// Adjoint of the translation by t: maps a tangent at the pivot t to the tangent at the origin.
[[nodiscard]] inline Matrix6 shift_adjoint(const Eigen::Vector3d& t) {
  Matrix6 Ad = Matrix6::Identity();
  Ad.topRightCorner<3, 3>() = SO3::hat(t);
  return Ad;
}

/// Root mean square distance [px] between the corners and their projections, from the residuals before
/// whitening.
[[nodiscard]] inline double rms_of(const Vector8& e) { return std::sqrt(e.squaredNorm() / 4); }

/// A step is the last one if its predicted gain is below this fraction of chi2 (or of 1e-3, if chi2 is nearly
/// zero). For a typical chi2, this corresponds to a thousandth of a standard deviation.
inline constexpr double kGainTolerance = 1e-6;

/// The result of a refinement.
struct Refined {
  SE3 cam_T_ref{};
  /// normal equations at cam_T_ref, unless the predicted gain of the last step was below the tolerance
  NormalEquations normal{};
  int iterations = 0;
  bool converged = false;
};

/// Minimises chi2 by the Levenberg-Marquardt method (pure Gauss-Newton as long as that lowers the cost).
///
/// `evaluate(cam_T_ref, cam_pivot, normal)` accumulates the normal equations at a pose, or returns false if a
/// point is not visible. `pivot_of(cam_T_ref)` returns the point in the camera frame about which a step
/// rotates; with a pivot near the points, the six unknowns are least correlated. Returns `nullopt` if a point
/// is not visible from the start pose.
template <class Evaluate, class PivotOf>
std::optional<Refined> refine(const SE3& start, int max_iterations, PivotOf&& pivot_of, Evaluate&& evaluate) {
  Refined at{.cam_T_ref = start};
  Eigen::Vector3d pivot = pivot_of(start);
  if (!evaluate(start, pivot, at.normal)) return std::nullopt;
  double damping = 0;
  while (at.iterations < max_iterations) {
    ++at.iterations;
    Matrix6 damped = at.normal.H;
    damped.diagonal() *= 1.0 + damping;
    const std::optional<Cholesky6> cholesky = Cholesky6::of(damped);
    if (!cholesky) return std::nullopt;
    const Vector6 step = -cholesky->solve(at.normal.g);
    const double gain = -step.dot(at.normal.g);  // the decrease in chi2 predicted by the linear model
    const SE3 next = perturbed(step, at.cam_T_ref, pivot);
    if (gain <= kGainTolerance * (1e-3 + at.normal.chi2)) {
      at.cam_T_ref = next;
      at.normal.chi2 = std::max(0.0, at.normal.chi2 - gain);
      at.converged = true;
      return at;
    }
    NormalEquations there;
    const Eigen::Vector3d next_pivot = pivot_of(next);
    if (evaluate(next, next_pivot, there) && there.chi2 <= at.normal.chi2) {
      at.cam_T_ref = next;
      at.normal = there;
      pivot = next_pivot;
      damping = damping < 1e-6 ? 0 : damping / 10;
    } else {
      damping = std::max(10 * damping, 1e-3);
    }
  }
  return at;
}

/// Both closed-form poses of a detected tag (see square_poses()). Fails if the size is not positive and
/// finite, or if the corners are not an image of a square. The corners may be non-finite, outside the field
/// of the lens, repeated, collinear, mirrored or out of order.
Result<std::array<SE3, 2>> starting_poses(const TagDetection& detection, double size_m,
                                          const CameraModel& camera);

/// Uses the detection's covariance, or sigma_px if it has none. Fails if the covariance is not finite and
/// positive definite.
Result<Whitening> whitening_of(const TagDetection& detection, double sigma_px);

}  // namespace waymark::internal
