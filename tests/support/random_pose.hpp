#pragma once

#include "waymark/base/random.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark::testing {

/// The exponential of a tangent with every component uniform within +-spread.
inline SE3 random_pose(Random& random, double spread_m, double spread_rad) {
  SE3::Tangent xi;
  for (int i = 0; i < 3; ++i) xi[i] = random.uniform(-spread_m, spread_m);
  for (int i = 3; i < 6; ++i) xi[i] = random.uniform(-spread_rad, spread_rad);
  return SE3::exp(xi);
}

}  // namespace waymark::testing
