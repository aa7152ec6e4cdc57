#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

/// A camera of a robot: the name in its samples, its lens, and where it is mounted.
struct MountedCamera {
  std::string name = "cam";
  CameraModel camera;
  SE3 base_T_cam{};  ///< optical frame: x right, y down, z forward

  friend bool operator==(const MountedCamera& a, const MountedCamera& b) {
    return a.name == b.name && a.camera == b.camera && a.base_T_cam.matrix() == b.base_T_cam.matrix();
  }
};

/// The camera of a sample: the one of this name; a robot's only camera whatever its name. nullptr: none.
[[nodiscard]] inline const MountedCamera* find_camera(const std::vector<MountedCamera>& cameras,
                                                      std::string_view name) {
  if (cameras.size() == 1) return &cameras.front();
  const auto found = std::ranges::find(cameras, name, &MountedCamera::name);
  return found == cameras.end() ? nullptr : &*found;
}

/// Lens and mounting of one camera of a setup, which outlives this.
struct CameraView {
  const CameraModel& camera;
  const SE3& base_T_cam;
};

/// Of a setup that has a first camera (`camera`, `base_T_cam`) and others by name (`more_cameras`): the one
/// of this name, else the first.
template <class Setup>
[[nodiscard]] CameraView camera_of(const Setup& setup, std::string_view name) {
  const auto found = std::ranges::find(setup.more_cameras, name, &MountedCamera::name);
  if (found != setup.more_cameras.end()) return {found->camera, found->base_T_cam};
  return {setup.camera, setup.base_T_cam};
}

}  // namespace waymark
