#include "waymark/replay/pure_pursuit.hpp"

#include <algorithm>
#include <cmath>

namespace waymark {

VelocityCommand pure_pursuit(const Route& route, const SE2& map_T_base, const RouteProgress& progress,
                             const PurePursuitOptions& options) {
  const SE2 map_T_goal = pose_at(route, progress.arc_length_m + options.look_ahead_m);
  const Eigen::Vector2d base_goal = map_T_base.inverse() * map_T_goal.translation();
  const double curvature = 2 * base_goal.y() / std::max(base_goal.squaredNorm(), 1e-4);
  double speed = route.points[progress.index].speed_m_s;
  if (!route.closed && options.slow_down_m > 0) {
    const double left = std::max(0.0, route.length_m - progress.arc_length_m);
    const double most = std::max(options.min_speed_m_s, std::abs(speed) * left / options.slow_down_m);
    speed = std::clamp(speed, -most, most);
  }
  return {speed, speed * curvature};
}

}  // namespace waymark
