#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

/// Pose of a camera body (x forward, y left, z up) on the base, as it would be measured by hand.
struct CameraMounting {
  double x_m = 0;
  double y_m = 0;
  double z_m = 0;
  double roll_rad = 0;
  double pitch_rad = 0;  ///< positive downwards
  double yaw_rad = 0;    ///< positive to the left
};

/// Rotation from optical axes (x right, y down, z forward) to those of a camera body (x forward, y left, z
/// up).
[[nodiscard]] inline SO3 body_R_optical() {
  return SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished());
}

[[nodiscard]] inline SE3 base_T_camera(const CameraMounting& m) {
  return {SO3::from_rpy(m.roll_rad, m.pitch_rad, m.yaw_rad) * body_R_optical(),
          Eigen::Vector3d(m.x_m, m.y_m, m.z_m)};
}

/// Inverse of base_T_camera, within rounding.
[[nodiscard]] inline CameraMounting camera_mounting(const SE3& base_T_cam) {
  const Eigen::Vector3d& t = base_T_cam.translation();
  const Eigen::Vector3d rpy = (base_T_cam.rotation() * body_R_optical().inverse()).rpy();
  return {t.x(), t.y(), t.z(), rpy.x(), rpy.y(), rpy.z()};
}

/// A camera on a robot: its name in samples, its model and its mounting.
struct MountedCamera {
  std::string name = "cam";
  CameraModel camera;
  SE3 base_T_cam{};  ///< optical frame: x right, y down, z forward

  friend bool operator==(const MountedCamera& a, const MountedCamera& b) {
    return a.name == b.name && a.camera == b.camera && a.base_T_cam.matrix() == b.base_T_cam.matrix();
  }
};

/// The camera with the name in a sample or, if the robot has only one camera, that one regardless of its
/// name. nullptr if not found.
[[nodiscard]] inline const MountedCamera* find_camera(const std::vector<MountedCamera>& cameras,
                                                      std::string_view name) {
  if (cameras.size() == 1) return &cameras.front();
  const auto found = std::ranges::find(cameras, name, &MountedCamera::name);
  return found == cameras.end() ? nullptr : &*found;
}

/// Model and mounting of one camera in a setup, which must outlive this struct.
struct CameraView {
  const CameraModel& camera;
  const SE3& base_T_cam;
};

/// Returns the camera with this name, otherwise the first. The setup has a first camera (`camera`,
/// `base_T_cam`) and others by name (`more_cameras`).
template <class Setup>
[[nodiscard]] CameraView camera_of(const Setup& setup, std::string_view name) {
  const auto found = std::ranges::find(setup.more_cameras, name, &MountedCamera::name);
  if (found != setup.more_cameras.end()) return {found->camera, found->base_T_cam};
  return {setup.camera, setup.base_T_cam};
}

}  // namespace waymark
