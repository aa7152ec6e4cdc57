#pragma once

#include <vector>

#include "waymark/geometry/se2.hpp"

namespace waymark {

/// One point of a route.
struct RoutePoint {
  SE2 map_T_base{};          ///< x where the robot looks: backwards where it reverses
  double arc_length_m = 0;   ///< of the way driven, from the first point; always grows
  double curvature_1_m = 0;  ///< turn of the robot over the way, positive to the left
  double speed_m_s = 0;      ///< reference speed; negative where the robot reverses
};

/// A path to drive, points in order of arc length. Closed: the first point follows the last, `length_m` after
/// the start.
struct Route {
  std::vector<RoutePoint> points{};
  bool closed = false;
  double length_m = 0;
};

}  // namespace waymark
