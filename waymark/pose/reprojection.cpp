#include "waymark/pose/reprojection.hpp"

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace waymark::internal {

std::optional<Whitening> Whitening::of(const CornerCovariance& covariance_px2) {
  if (!covariance_px2.allFinite()) return std::nullopt;
  const Eigen::LLT<CornerCovariance> llt(covariance_px2);
  if (llt.info() != Eigen::Success) return std::nullopt;
  Whitening whitening;
  whitening.inverse_sigma_ = 0;
  whitening.factor_ = llt.matrixL();
  return whitening;
}

void Whitening::apply(Vector8& e, Matrix86& J) const {
  if (isotropic()) {
    J *= inverse_sigma_;
  } else {
    factor_.triangularView<Eigen::Lower>().solveInPlace(J);
  }
  apply(e);
}

void Whitening::apply(Vector8& e) const {
  if (isotropic()) {
    e *= inverse_sigma_;
  } else {
    factor_.triangularView<Eigen::Lower>().solveInPlace(e);
  }
}

double Whitening::worst_corner_chi2(const Vector8& e) const {
  double worst = 0;
  for (int i = 0; i < 8; i += 2) {
    const Eigen::Vector2d corner = e.segment<2>(i);
    if (isotropic()) {
      worst = std::max(worst, corner.squaredNorm() * inverse_sigma_ * inverse_sigma_);
    } else {
      const Eigen::Matrix<double, 2, 8> rows = factor_.middleRows<2>(i);
      const Eigen::Matrix2d covariance = rows * rows.transpose();
      worst = std::max(worst, corner.dot(covariance.inverse() * corner));
    }
  }
  return worst;
}

void NormalEquations::add(const Vector8& e, const Matrix86& J, double weight) {
  H.noalias() += weight * J.transpose().lazyProduct(J);
  g.noalias() += weight * J.transpose().lazyProduct(e);
  chi2 += weight * e.squaredNorm();
}

bool corner_residuals(const CameraModel& camera, const Corners3& cam_corners,
                      const Eigen::Vector3d& cam_pivot, const Corners2& measured_px, Vector8& e,
                      Matrix86& J) {
  for (std::size_t i = 0; i < 4; ++i) {
    Matrix23 J_px_p;
    const std::optional<Eigen::Vector2d> px = camera.project(cam_corners[i], &J_px_p);
    if (!px) return false;
    const Eigen::Vector3d lever = cam_corners[i] - cam_pivot;
    const auto row = static_cast<Eigen::Index>(2 * i);
    e.segment<2>(row) = *px - measured_px[i];
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector3d gradient = J_px_p.row(k).transpose();
      J.row(row + k) << gradient.transpose(), lever.cross(gradient).transpose();
    }
  }
  return true;
}

}  // namespace waymark::internal
