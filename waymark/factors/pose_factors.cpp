#include "waymark/factors/pose_factors.hpp"

#include <cmath>

#include <Eigen/Cholesky>

#include "waymark/geometry/lie.hpp"

namespace waymark {
namespace {

template <int N>
Eigen::Matrix<double, N, N> inverse_factor(const Eigen::Matrix<double, N, N>& covariance) {
  Eigen::Matrix<double, N, N> whitening = Eigen::Matrix<double, N, N>::Identity();
  Eigen::LLT<Eigen::Matrix<double, N, N>>(covariance).matrixL().solveInPlace(whitening);
  return whitening;
}

/// d(origin of X)/d(xi) = [I, -t^].
Matrix36 origin_jacobian(const SE3& X) {
  Matrix36 J;
  J << Eigen::Matrix3d::Identity(), -SO3::hat(X.translation());
  return J;
}

}  // namespace

Matrix6 whitening_of(const Matrix6& covariance) { return inverse_factor<6>(covariance); }
Eigen::Matrix3d whitening_of(const Eigen::Matrix3d& covariance) { return inverse_factor<3>(covariance); }

Vector6 pose_prior_residual(const PosePriorFactor& factor, const SE3& X, Matrix6* J_r_X) {
  const Vector6 r = minus(X, factor.prior, J_r_X);
  if (J_r_X != nullptr) *J_r_X = (factor.whitening * *J_r_X).eval();
  return factor.whitening * r;
}

Vector6 pose_pair_prior_residual(const PosePairPriorFactor& factor, const SE3& A, const SE3& B,
                                 Matrix6* J_r_a, Matrix6* J_r_b) {
  const Vector6 r = minus(B, factor.prior_b, J_r_b) - factor.gain * minus(A, factor.prior_a, J_r_a);
  if (J_r_b != nullptr) *J_r_b = (factor.whitening * *J_r_b).eval();
  if (J_r_a != nullptr) *J_r_a = (-factor.whitening * factor.gain * *J_r_a).eval();
  return factor.whitening * r;
}

Vector6 relative_pose_residual(const RelativePoseFactor& factor, const SE3& map_T_a, const SE3& map_T_b,
                               Matrix6* J_r_a, Matrix6* J_r_b) {
  const SE3 sensor_T_map = (map_T_a * factor.body_T_sensor).inverse();
  const Vector6 r = minus(sensor_T_map * map_T_b * factor.body_T_sensor, factor.measured);
  if (J_r_a != nullptr || J_r_b != nullptr) {
    const Matrix6 J_r_map = factor.whitening * SE3::left_jacobian_inverse(r) * sensor_T_map.adjoint();
    if (J_r_a != nullptr) *J_r_a = -J_r_map;
    if (J_r_b != nullptr) *J_r_b = J_r_map;
  }
  return factor.whitening * r;
}

Eigen::Vector3d on_floor_residual(const OnFloorFactor& factor, const SE3& map_T_floor, const SE3& map_T_base,
                                  Matrix36* J_r_floor, Matrix36* J_r_base) {
  const SE3 floor_T_map = map_T_floor.inverse();
  const SE3 floor_T_base = floor_T_map * map_T_base;
  const Eigen::Vector3d up = floor_T_base.rotation() * Eigen::Vector3d::UnitZ();
  if (J_r_floor != nullptr || J_r_base != nullptr) {
    Matrix36 J = Matrix36::Zero();
    J.row(0) = origin_jacobian(floor_T_base).row(2) / factor.height_sigma_m;
    J.bottomRightCorner<2, 3>() = -SO3::hat(up).topRows<2>() / factor.tilt_sigma_rad;
    const Matrix36 J_r_map = J * floor_T_map.adjoint();
    if (J_r_floor != nullptr) *J_r_floor = -J_r_map;
    if (J_r_base != nullptr) *J_r_base = J_r_map;
  }
  return {floor_T_base.translation().z() / factor.height_sigma_m, up.x() / factor.tilt_sigma_rad,
          up.y() / factor.tilt_sigma_rad};
}

double distance_residual(const DistanceFactor& factor, const SE3& a, const SE3& b,
                         Eigen::Matrix<double, 1, 6>* J_r_a, Eigen::Matrix<double, 1, 6>* J_r_b) {
  const Eigen::Vector3d between = b.translation() - a.translation();
  const double length = between.norm();
  const Eigen::RowVector3d direction = length > 0 ? Eigen::RowVector3d(between.transpose() / length)
                                                  : Eigen::RowVector3d(Eigen::RowVector3d::UnitX());
  if (J_r_a != nullptr) *J_r_a = -direction * origin_jacobian(a) / factor.sigma_m;
  if (J_r_b != nullptr) *J_r_b = direction * origin_jacobian(b) / factor.sigma_m;
  return (length - factor.measured_m) / factor.sigma_m;
}

double coordinate_residual(const CoordinateFactor& factor, const SE3& X, Eigen::Matrix<double, 1, 6>* J_r_X) {
  if (J_r_X != nullptr) *J_r_X = factor.direction.transpose() * origin_jacobian(X) / factor.sigma_m;
  return (factor.direction.dot(X.translation()) - factor.measured_m) / factor.sigma_m;
}

TagPoint tag_point(const SE3& map_T_body, const SE3& body_T_tag, const Eigen::Vector3d& tag_p) {
  const Eigen::Vector3d body_p = body_T_tag * tag_p;
  TagPoint point{.map_p = map_T_body * body_p};
  point.J_p_body << Eigen::Matrix3d::Identity(), -SO3::hat(point.map_p);
  Matrix36 J_body;
  J_body << Eigen::Matrix3d::Identity(), -SO3::hat(body_p);
  point.J_p_tag = map_T_body.rotation().matrix() * J_body;
  return point;
}

double point_distance_residual(double measured_m, double sigma_m, const Eigen::Vector3d& map_p_a,
                               const Eigen::Vector3d& map_p_b, Eigen::RowVector3d* J_r_a) {
  const Eigen::Vector3d between = map_p_a - map_p_b;
  const double length = between.norm();
  if (J_r_a != nullptr) {
    *J_r_a = length > 0 ? Eigen::RowVector3d(between.transpose() / (length * sigma_m))
                        : Eigen::RowVector3d(Eigen::RowVector3d::UnitX() / sigma_m);
  }
  return (length - measured_m) / sigma_m;
}

Eigen::Vector2d direction_residual(const DirectionFactor& factor, const SE3& map_T_body,
                                   const SE3& body_T_tag, Matrix26* J_r_body, Matrix26* J_r_tag) {
  const Eigen::Vector3d body_axis = body_T_tag.rotation() * factor.tag_axis;
  const Eigen::Vector3d map_axis = map_T_body.rotation() * body_axis;
  const Eigen::Vector3d first = factor.map_direction.unitOrthogonal();
  Eigen::Matrix<double, 2, 3> across;
  across << first.transpose(), factor.map_direction.cross(first).transpose();
  across /= factor.sigma_rad;
  if (J_r_body != nullptr) *J_r_body << Eigen::Matrix<double, 2, 3>::Zero(), -across * SO3::hat(map_axis);
  if (J_r_tag != nullptr)
    *J_r_tag << Eigen::Matrix<double, 2, 3>::Zero(),
        -across * map_T_body.rotation().matrix() * SO3::hat(body_axis);
  return across * map_axis;
}

}  // namespace waymark
