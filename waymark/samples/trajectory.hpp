#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/time.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

struct StampedPose {
  SensorTime stamp{};
  SE3 map_T_base{};
};

/// Poses of the base in order of time.
using Trajectory = std::vector<StampedPose>;

/// An estimated pose of the base, with its covariance.
struct EstimatedPose {
  SensorTime stamp{};
  SE3 map_T_base{};
  /// Covariance of x [m], y [m] and yaw [rad] in ordinary map coordinates; empty if the source does not
  /// provide it.
  std::optional<Eigen::Matrix3d> covariance{};
};

/// Estimated poses in order of time.
using EstimatedTrajectory = std::vector<EstimatedPose>;

}  // namespace waymark
