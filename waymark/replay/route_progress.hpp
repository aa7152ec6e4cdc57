#pragma once

#include <cstddef>
#include <optional>

#include "waymark/samples/route.hpp"

namespace waymark {

/// Where a robot is beside a route.
struct RouteProgress {
  std::size_t index = 0;         ///< of the point at or before the foot point
  double arc_length_m = 0;       ///< of the foot point
  double cross_track_m = 0;      ///< signed: positive when the robot is to the left of the route
  double heading_error_rad = 0;  ///< robot's heading less the route's
  SE2 map_T_route{};             ///< foot point, x along the route
};

/// The foot point nearest to the robot anywhere on the route. O(points).
[[nodiscard]] RouteProgress locate(const Route& route, const SE2& map_T_base);

/// The foot point near where it was before: looks `window_m` ahead and a little back, so that the robot
/// cannot jump to another branch where a route crosses itself or closes. O(window).
[[nodiscard]] RouteProgress advance(const Route& route, const SE2& map_T_base, const RouteProgress& before,
                                    double window_m = 0.5);

/// The pose of the route at an arc length; a closed route goes round, an open one ends.
[[nodiscard]] SE2 pose_at(const Route& route, double arc_length_m);

}  // namespace waymark
