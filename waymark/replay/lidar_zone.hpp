#pragma once

#include "waymark/geometry/se2.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// How far the hull, widened by `margin_m` on both sides, can drive on a curve before it meets what a scan
/// saw: forwards, or backwards when `backwards`. Infinite when nothing is in the way within `reach_m`. Points
/// inside the hull are the robot itself. O(rays).
[[nodiscard]] double free_way_m(const LaserScan& scan, const SE2& base_T_lidar, const Hull& hull,
                                double curvature_1_m, bool backwards, double margin_m = 0.03,
                                double reach_m = 3);

}  // namespace waymark
