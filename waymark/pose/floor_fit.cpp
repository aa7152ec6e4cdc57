#include "waymark/pose/floor_fit.hpp"

#include <Eigen/Cholesky>

#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

/// The columns of the SE(3) tangent that correspond to lift(X): x, y and rotation about z.
Eigen::Matrix<double, 6, 3> plane_in_space() {
  Eigen::Matrix<double, 6, 3> A = Eigen::Matrix<double, 6, 3>::Zero();
  A(0, 0) = A(1, 1) = A(5, 2) = 1;
  return A;
}

Covariance<SE3> with_floor(const Covariance<SE3>& measured, const FloorOptions& options) {
  constexpr double kMinSigma = 1e-6;  // a zero covariance means unknown, not exact
  const double tilt = options.tilt_sigma_rad * options.tilt_sigma_rad;
  const double height = options.height_sigma_m * options.height_sigma_m;
  Covariance<SE3> P = measured;
  P.diagonal().array() += kMinSigma * kMinSigma;
  P.diagonal().segment<3>(2) += Eigen::Vector3d(height, tilt, tilt);
  return P;
}

}  // namespace

FloorFit fit_to_floor(const Uncertain<SE3>& base_T_tag, const SE3& shape, const FloorOptions& options) {
  constexpr int kIterations = 4;
  const Eigen::Matrix<double, 6, 3> A = plane_in_space();
  const Eigen::LLT<Covariance<SE3>> llt(with_floor(base_T_tag.covariance, options));
  const Eigen::Matrix<double, 6, 3> WA = llt.solve(A);
  const Eigen::Matrix3d covariance = (A.transpose() * WA).inverse();
  FloorFit fit{.a_X_b = {project_to_plane(base_T_tag.mean * shape.inverse()), covariance}};
  for (int i = 0; i < kIterations; ++i) {
    const SE3::Tangent r = minus(base_T_tag.mean, lift(fit.a_X_b.mean) * shape);
    fit.chi2 = r.dot(llt.solve(r));
    const Eigen::Vector3d step = covariance * (WA.transpose() * r);
    fit.a_X_b.mean = plus(SE2::Tangent(step), fit.a_X_b.mean);
    fit.chi2 = std::max(0.0, fit.chi2 - step.dot(WA.transpose() * r));
    if (step.squaredNorm() < 1e-20) break;
  }
  return fit;
}

}  // namespace waymark
