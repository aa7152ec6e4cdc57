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

}  // namespace waymark
