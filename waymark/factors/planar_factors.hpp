#pragma once

#include <Eigen/Core>

#include "waymark/geometry/se2.hpp"

/// Measurements of a robot that moves in the plane among points. Its pose is three plain numbers (x, y, yaw):
/// perturbations are added, and yaw may exceed a full turn.
namespace waymark {

/// A point measured by a sensor, in base axes according to the assumed mounting.
struct PlanarPointFactor {
  Eigen::Vector2d base_p = Eigen::Vector2d::Zero();  ///< measured position in base axes
  Eigen::Matrix2d whitening = Eigen::Matrix2d::Identity();
};

/// Jacobians J_r_x of the whitened residual, one for each argument.
struct PlanarPointJacobians {
  Eigen::Matrix<double, 2, 3> base;
  Eigen::Matrix2d point;
  Eigen::Matrix<double, 2, 3> mounting;
};

/// Whitened residual: the point relative to the base minus the measured point, corrected by `mounting` (x, y,
/// yaw), the true pose of the sensor relative to its assumed pose.
[[nodiscard]] Eigen::Vector2d planar_point_residual(const PlanarPointFactor& factor,
                                                    const Eigen::Vector3d& map_X_base,
                                                    const Eigen::Vector2d& map_p,
                                                    const Eigen::Vector3d& mounting,
                                                    PlanarPointJacobians* J = nullptr);

/// A motion measured by wheels: its twist (x, y, yaw), assumed constant, whose components are scaled.
struct PlanarMotionFactor {
  SE2::Tangent twist = SE2::Tangent::Zero();
  Eigen::Vector3d inverse_sigma = Eigen::Vector3d::Ones();  ///< for x, y and yaw
};

struct PlanarMotionJacobians {
  Eigen::Matrix3d a;
  Eigen::Matrix3d b;
  Eigen::Matrix<double, 3, 2> scales;
};

/// Whitened residual: the pose of B relative to A minus the motion scaled by `scales` (distances, turns), in
/// A's axes.
[[nodiscard]] Eigen::Vector3d planar_motion_residual(const PlanarMotionFactor& factor,
                                                     const Eigen::Vector3d& map_X_a,
                                                     const Eigen::Vector3d& map_X_b,
                                                     const Eigen::Vector2d& scales,
                                                     PlanarMotionJacobians* J = nullptr);

}  // namespace waymark
