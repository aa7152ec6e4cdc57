#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/geometry/se3.hpp"

namespace waymark {

/// What one picture of a calibration showed, and what the calibration says of it.
struct CameraObservation {
  std::string picture{};
  SE3 cam_T_target{};
  std::vector<Eigen::Vector3d> target_points_m{};
  std::vector<Eigen::Vector2d> seen_px{};  ///< as many; pixel centres at +1/2
  std::vector<Eigen::Vector2d>
      errors_px{};           ///< as many: projected minus seen; not finite where nothing projects
  std::vector<bool> used{};  ///< as many
};

}  // namespace waymark
