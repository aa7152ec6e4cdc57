#pragma once

#include <algorithm>
#include <cstddef>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"

namespace waymark::internal {

/// Index of the cell that contains a pixel if the image is divided into 3 x 3 cells, counted row by row. For
/// a pixel outside the image, returns the nearest cell.
[[nodiscard]] inline std::size_t ninth_of(const Eigen::Vector2d& px, const CameraModel& camera) {
  const auto third = [](double share) { return static_cast<std::size_t>(std::clamp(3 * share, 0.0, 2.0)); };
  return 3 * third(px.y() / camera.height_px()) + third(px.x() / camera.width_px());
}

}  // namespace waymark::internal
