#include "waymark/factors/odometry_factor.hpp"

namespace waymark {
namespace {

/// d(off, yaw)/d(xi) in frame a: the origin of b moves by rho + phi x t, its x axis by phi x forward.
Eigen::Matrix<double, 3, 6> planar_jacobian(const SE3& a_T_b, const Eigen::Vector3d& forward,
                                            const SO2& b_R_a) {
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
  const Eigen::Matrix3d across = -SO3::hat(a_T_b.translation());
  J.topLeftCorner<2, 2>() = b_R_a.matrix();
  J.topRightCorner<2, 3>() = b_R_a.matrix() * across.topRows<2>();
  const double length2 = forward.head<2>().squaredNorm();
  const Eigen::RowVector3d J_yaw_forward(-forward.y() / length2, forward.x() / length2, 0);
  J.row(2).tail<3>() = -J_yaw_forward * SO3::hat(forward);
  return J;
}

using ScaleJacobian = Eigen::Matrix<double, 3, OdometryScales::kCount>;

/// The twist that the wheels should measure for a motion, and its derivatives.
SE2::Tangent predicted_twist(const SE2::Tangent& twist, const OdometryFactor& factor,
                             const OdometryScales& scales, Eigen::Matrix3d& J_twist, ScaleJacobian& J) {
  const double slip = factor.duration_s > 0 ? scales.lateral_slip_s / factor.duration_s : 0;
  const double across = twist[1] - slip * twist[0] * twist[2];
  const SE2::Tangent predicted(twist[0] / scales.distance, across / scales.distance, twist[2] / scales.yaw);
  J_twist << 1, 0, 0, -slip * twist[2], 1, -slip * twist[0], 0, 0, scales.distance / scales.yaw;
  J_twist /= scales.distance;
  J.setZero();
  J.col(0).head<2>() = -predicted.head<2>() / scales.distance;
  J(2, 1) = -predicted[2] / scales.yaw;
  if (factor.duration_s > 0) J(1, 2) = -twist[0] * twist[2] / (factor.duration_s * scales.distance);
  J.col(3) = factor.rate_change;
  J(2, 4) = factor.rate_change[2];
  J(2, 5) = factor.duration_s;
  return predicted + J.rightCols<3>() *
                         Eigen::Vector3d(scales.camera_latency_s, scales.turn_lead_s, scales.yaw_bias_rad_s);
}

}  // namespace

SE2 scaled_motion(const OdometryFactor& factor, const OdometryScales& scales) {
  SE2::Tangent twist = factor.measured.log() - scales.camera_latency_s * factor.rate_change;
  twist[2] -= scales.turn_lead_s * factor.rate_change[2] + scales.yaw_bias_rad_s * factor.duration_s;
  const double way = scales.distance * twist[0];
  const double turn = scales.yaw * twist[2];
  const double slip = factor.duration_s > 0 ? scales.lateral_slip_s / factor.duration_s : 0;
  return SE2::exp({way, scales.distance * twist[1] + slip * way * turn, turn});
}

Eigen::Vector3d odometry_residual(const OdometryFactor& factor, const OdometryScales& scales,
                                  const SE3& map_T_a, const SE3& map_T_b, OdometryJacobians* J) {
  const SE3 a_T_map = map_T_a.inverse();
  const SE3 a_T_b = a_T_map * map_T_b;
  const Eigen::Vector3d forward = a_T_b.rotation() * Eigen::Vector3d::UnitX();
  const SE2 a_X_b(SO2::from_cos_sin(forward.x(), forward.y()), a_T_b.translation().head<2>());
  const SE2::Tangent twist = a_X_b.log();
  Eigen::Matrix3d J_twist;
  ScaleJacobian J_scales;
  const SE2::Tangent predicted = predicted_twist(twist, factor, scales, J_twist, J_scales);
  if (J != nullptr) {
    const Eigen::Matrix3d J_motion = J_twist * SE2::right_jacobian_inverse(twist);
    J->b = factor.whitening * J_motion * planar_jacobian(a_T_b, forward, a_X_b.rotation().inverse()) *
           a_T_map.adjoint();
    J->a = -J->b;
    J->scales = factor.whitening * J_scales;
  }
  return factor.whitening * (predicted - factor.measured.log());
}

}  // namespace waymark
