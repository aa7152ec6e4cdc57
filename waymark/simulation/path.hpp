#pragma once

#include <vector>

#include <Eigen/Core>

#include "waymark/geometry/se2.hpp"

namespace waymark {

/// A point of a sampled path.
struct PathPoint {
  SE2 map_T_path{};  ///< x along the path
  double arc_length_m = 0;
  double curvature_1_m = 0;
};

/// Samples a smooth curve through points (centripetal Catmull-Rom: Barry and Goldman, "A recursive evaluation
/// algorithm for a class of Catmull-Rom splines", SIGGRAPH 1988; Yuksel et al. 2011) at even steps of arc
/// length of about `step_m`. Empty for fewer than three distinct points.
[[nodiscard]] std::vector<PathPoint> sample_path(const std::vector<Eigen::Vector2d>& points_m, bool closed,
                                                 double step_m);

}  // namespace waymark
