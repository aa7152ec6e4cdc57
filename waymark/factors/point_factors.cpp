#include "waymark/factors/point_factors.hpp"

namespace waymark {

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
