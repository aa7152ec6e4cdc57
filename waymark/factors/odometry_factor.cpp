#include "waymark/factors/odometry_factor.hpp"

namespace waymark {
namespace {

/// d(off, yaw)/d(xi) in the frame of a: the origin of b moves by rho + phi x t, its x axis by phi x forward.
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

/// What the base truly did, and its derivative for the scales.
SE2::Tangent scaled_twist(const OdometryFactor& factor, const OdometryScales& scales, ScaleJacobian& J) {
  SE2::Tangent twist = factor.measured.log() - scales.latency_s * factor.rate_change;
  twist[2] -= scales.turn_lead_s * factor.rate_change[2] + scales.yaw_bias_rad_s * factor.duration_s;
  const double per_s = factor.duration_s > 0 ? 1 / factor.duration_s : 0;
  const double way = scales.distance * twist[0];
  const double turn = scales.yaw * twist[2];
  const SE2::Tangent late = -factor.rate_change;
  const double slip = scales.slip_s * per_s;
  J.col(0) << twist[0], twist[1] + slip * twist[0] * turn, 0;
  J.col(1) << 0, slip * way * twist[2], twist[2];
  J.col(2) << 0, way * turn * per_s, 0;
  J.col(3) << scales.distance * late[0],
      scales.distance * late[1] + slip * (scales.distance * late[0] * turn + way * scales.yaw * late[2]),
      scales.yaw * late[2];
  J.col(4) << 0, slip * way * scales.yaw * late[2], scales.yaw * late[2];
  J.col(5) << 0, -slip * way * scales.yaw * factor.duration_s, -scales.yaw * factor.duration_s;
  return {way, scales.distance * twist[1] + slip * way * turn, turn};
}

}  // namespace

SE2 scaled_motion(const OdometryFactor& factor, const OdometryScales& scales) {
  ScaleJacobian unused;
  return SE2::exp(scaled_twist(factor, scales, unused));
}

Eigen::Vector3d odometry_residual(const OdometryFactor& factor, const OdometryScales& scales,
                                  const SE3& map_T_a, const SE3& map_T_b, OdometryJacobians* J) {
  ScaleJacobian J_scaled;
  const SE2::Tangent scaled = scaled_twist(factor, scales, J_scaled);
  const SE2 a_X_b = SE2::exp(scaled);
  const SE3 a_T_map = map_T_a.inverse();
  const SE3 a_T_b = a_T_map * map_T_b;
  const Eigen::Vector3d forward = a_T_b.rotation() * Eigen::Vector3d::UnitX();
  const SO2 b_R_a = a_X_b.rotation().inverse();
  const Eigen::Vector2d off = b_R_a * Eigen::Vector2d(a_T_b.translation().head<2>() - a_X_b.translation());
  const double yaw = (b_R_a * SO2::from_cos_sin(forward.x(), forward.y())).angle();
  if (J != nullptr) {
    J->b = factor.whitening * planar_jacobian(a_T_b, forward, b_R_a) * a_T_map.adjoint();
    J->a = -J->b;
    // The motion's end moves by d = J_right dscaled in its own axes; then the residual moves by -d and turns
    // by -d_yaw.
    const ScaleJacobian d = SE2::right_jacobian(scaled) * J_scaled;
    Eigen::Matrix3d turn = -Eigen::Matrix3d::Identity();
    turn.topRightCorner<2, 1>() << off.y(), -off.x();
    J->scales = factor.whitening * turn * d;
  }
  return factor.whitening * Eigen::Vector3d(off.x(), off.y(), yaw);
}

}  // namespace waymark
