#include "waymark/replay/go_to_pose.hpp"

#include <algorithm>
#include <cmath>

namespace waymark {

VelocityCommand go_to_pose(const Route& route, const SE2& map_T_base, const RouteProgress& progress,
                           const GoToPoseOptions& options) {
  const double half = options.waypoint_m / 2;  // a goal nearer than this is reached
  const double goal_m =
      options.waypoint_m * (std::floor((progress.arc_length_m + half) / options.waypoint_m) + 1);
  const Eigen::Vector2d base_goal = map_T_base.inverse() * pose_at(route, goal_m).translation();
  const double aside = std::atan2(base_goal.y(), base_goal.x());
  const double most = std::abs(route.points[progress.index].speed_m_s);
  const double speed = std::abs(aside) > options.turn_first_rad
                           ? 0
                           : std::min(most, options.speed_gain_1_s * base_goal.norm());
  return {speed, options.heading_gain_1_s * aside};
}

}  // namespace waymark
