#pragma once

#include "waymark/base/fields.hpp"
#include "waymark/replay/route_progress.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

struct GoToPoseOptions {
  double waypoint_m = 0.3;
  double speed_gain_1_s = 0.6;
  double heading_gain_1_s = 2.0;
  double turn_first_rad = 0.25;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.waypoint_m, Field{"waypoint_m", "Spacing of the goals along the route.", 0.05, 5});
    visit(self.speed_gain_1_s,
          Field{"speed_gain_1_s", "Proportional gain from the distance to the goal to the speed.", 0.01, 10});
    visit(
        self.heading_gain_1_s,
        Field{"heading_gain_1_s", "Proportional gain from the angle to the goal to the yaw rate.", 0.01, 20});
    visit(self.turn_first_rad,
          Field{"turn_first_rad", "Angle to the goal above which the robot turns on the spot.", 0.01, 3});
  }
};

/// Drives from goal to goal by its distance and direction, turning on the spot first: the controller that
/// students' projects use (Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot",
/// go_to_pose), fed with points of the route. For comparison. O(log points).
[[nodiscard]] VelocityCommand go_to_pose(const Route& route, const SE2& map_T_base,
                                         const RouteProgress& progress, const GoToPoseOptions& options = {});

}  // namespace waymark
