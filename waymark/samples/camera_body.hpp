#pragma once

#include "waymark/geometry/se3.hpp"

namespace waymark {

/// Where the body of a camera (x forward, y left, z up) sits on the base, as people measure it.
struct CameraMounting {
  double x_m = 0;
  double y_m = 0;
  double z_m = 0;
  double roll_rad = 0;
  double pitch_rad = 0;  ///< downwards is positive
  double yaw_rad = 0;    ///< to the left is positive
};

/// Optical axes (x right, y down, z forward) in those of a camera's body (x forward, y left, z up).
[[nodiscard]] inline SO3 body_R_optical() {
  return SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished());
}

[[nodiscard]] inline SE3 base_T_camera(const CameraMounting& m) {
  return {SO3::from_rpy(m.roll_rad, m.pitch_rad, m.yaw_rad) * body_R_optical(),
          Eigen::Vector3d(m.x_m, m.y_m, m.z_m)};
}

/// Undoes base_T_camera, within rounding.
[[nodiscard]] inline CameraMounting camera_mounting(const SE3& base_T_cam) {
  const Eigen::Vector3d& t = base_T_cam.translation();
  const Eigen::Vector3d rpy = (base_T_cam.rotation() * body_R_optical().inverse()).rpy();
  return {t.x(), t.y(), t.z(), rpy.x(), rpy.y(), rpy.z()};
}

}  // namespace waymark
