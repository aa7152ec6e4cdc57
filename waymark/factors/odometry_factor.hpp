#pragma once

#include <Eigen/Core>

#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

/// What the wheels' distances and turns must be multiplied by: wheel size, tyre wear, tread, skid.
struct OdometryScales {
  double distance = 1;
  double yaw = 1;
};

/// A motion on the floor measured by wheels, from base at A to base at B. The twist log(measured) = (x, y,
/// yaw) is taken as constant and its parts scaled.
struct OdometryFactor {
  SE2 measured{};  ///< a_X_b
  Eigen::Matrix3d whitening = Eigen::Matrix3d::Identity();
};

/// J_r_X of the whitened residual.
struct OdometryJacobians {
  Eigen::Matrix<double, 3, 6> a;
  Eigen::Matrix<double, 3, 6> b;
  Eigen::Matrix<double, 3, 2> scales;  ///< for (distance, yaw)
};

/// Whitened residual: x, y [m] of B's origin and its heading [rad] less those of the scaled motion, in base
/// axes at the motion's end. Heading is about the z axis of base at A; height and tilts do not enter.
[[nodiscard]] Eigen::Vector3d odometry_residual(const OdometryFactor& factor, const OdometryScales& scales,
                                                const SE3& map_T_a, const SE3& map_T_b,
                                                OdometryJacobians* J = nullptr);

}  // namespace waymark
