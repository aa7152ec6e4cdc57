#pragma once

#include <algorithm>
#include <cstddef>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"

namespace waymark::internal {

/// Which ninth of the picture a pixel lies in (three by three, row by row); beyond its border the nearest.
[[nodiscard]] inline std::size_t ninth_of(const Eigen::Vector2d& px, const CameraModel& camera) {
  const auto third = [](double share) { return static_cast<std::size_t>(std::clamp(3 * share, 0.0, 2.0)); };
  return 3 * third(px.y() / camera.height_px()) + third(px.x() / camera.width_px());
}

}  // namespace waymark::internal
