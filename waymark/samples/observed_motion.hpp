#pragma once

#include "waymark/base/time.hpp"
#include "waymark/geometry/se2.hpp"

namespace waymark {

/// Motion of the base between two images, estimated from tags alone, without odometry or gyro.
struct ObservedMotion {
  SensorTime from{};
  SensorTime to{};
  /// Logarithm of the motion: x, y [m] and yaw [rad] in the base frame at `from`.
  SE2::Tangent twist = SE2::Tangent::Zero();
  double sigma_m = 0;    ///< standard deviation of x; infinite if x is unknown
  double sigma_rad = 0;  ///< standard deviation of yaw
};

}  // namespace waymark
