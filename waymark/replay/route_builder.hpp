#pragma once

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/samples/route.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

struct RouteOptions {
  double step_m = 0.05;
  double smoothing_m = 0.6;
  double max_curvature_1_m = 4;
  double speed_m_s = 0.3;
  double closing_distance_m = 0.5;
  double closing_angle_rad = 0.8;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.step_m, Field{"step_m", "Spacing of the route points.", 0.005, 1});
    visit(self.smoothing_m,
          Field{"smoothing_m",
                "Length of the smoothing window; longer removes more driving noise and cuts corners.", 0, 5});
    visit(self.max_curvature_1_m,
          Field{"max_curvature_1_m", "Maximum curvature of the route (1 / radius); 0: as driven.", 0, 1000});
    visit(self.speed_m_s, Field{"speed_m_s", "Reference speed of the whole route.", 0.01, 5});
    visit(self.closing_distance_m,
          Field{"closing_distance_m",
                "Distance between start and end of a lap below which the route is closed.", 0, 10});
    visit(self.closing_angle_rad,
          Field{"closing_angle_rad",
                "Angle between the headings at start and end below which the route is closed.", 0, 3.2});
  }
};

struct BuiltRoute : Route {
  double repeated_m = 0;  ///< driven beyond the closing point and cut off, because it repeats the route
};

/// The route a trajectory drove, on the floor: even steps of arc length, smoothed, closed where the lap came
/// back to its start and the rest repeats it (lap_closing.hpp; the rest is cut off). A rest that leads
/// elsewhere is part of the route. Where the robot reversed, the speed changes its sign; such a route stays
/// open. Standing still adds nothing. Fails on a trajectory shorter than half a metre. O(poses) per return to
/// the start.
[[nodiscard]] Result<BuiltRoute> build_route(const Trajectory& trajectory, const RouteOptions& options = {});

}  // namespace waymark
