#pragma once

#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

struct StampedPose {
  SensorTime stamp{};
  SE3 map_T_base{};
};

/// Where the base was, in order of time.
using Trajectory = std::vector<StampedPose>;

}  // namespace waymark
