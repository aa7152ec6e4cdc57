#pragma once

#include <array>
#include <optional>

#include "waymark/camera/camera_model.hpp"
#include "waymark/mapping/camera/intrinsics_fit.hpp"

namespace waymark::internal {

/// A mark's points in the camera's frame.
[[nodiscard]] std::array<Eigen::Vector3d, 4> camera_points(const ViewMark& mark, const SE3& cam_T_target);

/// Where a mark's points project; nothing when one does not.
[[nodiscard]] std::optional<MarkVector> projected(const ViewMark& mark,
                                                  const std::array<Eigen::Vector3d, 4>& cam_points,
                                                  const CameraModel& camera);

}  // namespace waymark::internal
