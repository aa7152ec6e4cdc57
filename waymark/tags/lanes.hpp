#pragma once

#include <Eigen/Core>

#include "waymark/tags/lane_math.hpp"

namespace waymark::refinement {

/// What the compiler makes of it (SSE, NEON or a loop) is its business.
using Lanes = Eigen::Array<float, kLanes, 1>;

template <>
[[gnu::always_inline]] inline Lanes load<Lanes>(const float* lanes) {
  return Eigen::Map<const Lanes>(lanes);
}
template <>
[[gnu::always_inline]] inline void store<Lanes>(const Lanes& lanes, float* to) {
  Eigen::Map<Lanes>{to} = lanes;
}

}  // namespace waymark::refinement
