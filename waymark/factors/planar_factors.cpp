#include "waymark/factors/planar_factors.hpp"

#include <Eigen/Geometry>

namespace waymark {
namespace {

Eigen::Matrix2d rotation(double angle) { return Eigen::Rotation2Dd(angle).toRotationMatrix(); }

/// d(R(a) v)/da = (-y, x) of R(a) v; for R(a)^T v, it is the negative of this.
Eigen::Vector2d quarter_turn(const Eigen::Vector2d& turned) { return {-turned.y(), turned.x()}; }

}  // namespace

Eigen::Vector2d planar_point_residual(const PlanarPointFactor& factor, const Eigen::Vector3d& map_X_base,
                                      const Eigen::Vector2d& map_p, const Eigen::Vector3d& mounting,
                                      PlanarPointJacobians* J) {
  const Eigen::Matrix2d base_R_map = rotation(map_X_base.z()).transpose();
  const Eigen::Vector2d expected = base_R_map * (map_p - map_X_base.head<2>());
  const Eigen::Vector2d measured = rotation(mounting.z()) * factor.base_p;
  if (J != nullptr) {
    J->base << -factor.whitening * base_R_map, -factor.whitening * quarter_turn(expected);
    J->point = factor.whitening * base_R_map;
    J->mounting << -factor.whitening, -factor.whitening * quarter_turn(measured);
  }
  return factor.whitening * (expected - (measured + mounting.head<2>()));
}

Eigen::Vector3d planar_motion_residual(const PlanarMotionFactor& factor, const Eigen::Vector3d& map_X_a,
                                       const Eigen::Vector3d& map_X_b, const Eigen::Vector2d& scales,
                                       PlanarMotionJacobians* J) {
  const Eigen::Matrix2d a_R_map = rotation(map_X_a.z()).transpose();
  const Eigen::Vector2d way = a_R_map * (map_X_b.head<2>() - map_X_a.head<2>());
  const SE2::Tangent scaled(scales.x() * factor.twist.x(), scales.x() * factor.twist.y(),
                            scales.y() * factor.twist.z());
  const SE2 motion = SE2::exp(scaled);
  // Yaw is not taken from `motion`, where it is wrapped.
  const Eigen::Vector3d r(way.x() - motion.x(), way.y() - motion.y(), map_X_b.z() - map_X_a.z() - scaled.z());
  if (J != nullptr) {
    J->a.setZero();
    J->a.topLeftCorner<2, 2>() = -a_R_map;
    J->a.topRightCorner<2, 1>() = -quarter_turn(way);
    J->a(2, 2) = -1;
    J->b.setZero();
    J->b.topLeftCorner<2, 2>() = a_R_map;
    J->b(2, 2) = 1;
    // The end of the motion moves by J_right d(scaled) in the axes of that end pose.
    Eigen::Matrix<double, 3, 2> J_scaled = Eigen::Matrix<double, 3, 2>::Zero();
    J_scaled.col(0).head<2>() = factor.twist.head<2>();
    J_scaled(2, 1) = factor.twist.z();
    const Eigen::Matrix<double, 3, 2> d = SE2::right_jacobian(scaled) * J_scaled;
    J->scales.topRows<2>() = -(motion.rotation().matrix() * d.topRows<2>());
    J->scales.row(2) = -d.row(2);
    const auto W = factor.inverse_sigma.asDiagonal();
    J->a = W * J->a;
    J->b = W * J->b;
    J->scales = (W * J->scales).eval();
  }
  return factor.inverse_sigma.cwiseProduct(r);
}

}  // namespace waymark
