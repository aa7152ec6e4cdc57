#pragma once

#include <Eigen/Core>

#include "waymark/factors/pose_factors.hpp"

namespace waymark {

/// A point of a tag on a body in the map: map_p = map_T_body body_T_tag tag_p.
struct TagPoint {
  Eigen::Vector3d map_p = Eigen::Vector3d::Zero();
  Matrix36 J_p_body = Matrix36::Zero();  ///< for left perturbations
  Matrix36 J_p_tag = Matrix36::Zero();
};
[[nodiscard]] TagPoint tag_point(const SE3& map_T_body, const SE3& body_T_tag, const Eigen::Vector3d& tag_p);

/// A distance between points of two tags, over its standard deviation; J_r_p for the first point, that of the
/// second is its opposite.
[[nodiscard]] double point_distance_residual(double measured_m, double sigma_m,
                                             const Eigen::Vector3d& map_p_a, const Eigen::Vector3d& map_p_b,
                                             Eigen::RowVector3d* J_r_a = nullptr);

/// An axis of a tag that is known to point along a direction of the map, or against it: "upright" is the
/// tag's y axis along the map's z axis. Both of unit length.
struct DirectionFactor {
  Eigen::Vector3d tag_axis = Eigen::Vector3d::UnitY();
  Eigen::Vector3d map_direction = Eigen::Vector3d::UnitZ();
  double sigma_rad = 0.02;
};
using Matrix26 = Eigen::Matrix<double, 2, 6>;
/// The two components of the axis across the direction, over the standard deviation: sines of the angles.
[[nodiscard]] Eigen::Vector2d direction_residual(const DirectionFactor& factor, const SE3& map_T_body,
                                                 const SE3& body_T_tag, Matrix26* J_r_body = nullptr,
                                                 Matrix26* J_r_tag = nullptr);

}  // namespace waymark
