#pragma once

#include "waymark/base/fields.hpp"
#include "waymark/replay/route_progress.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

struct PurePursuitOptions {
  double look_ahead_m = 0.30;
  double slow_down_m = 0.40;
  double min_speed_m_s = 0.05;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.look_ahead_m,
          Field{"look_ahead_m", "Look-ahead distance; shorter follows closer and oscillates more.", 0.05, 5});
    visit(self.slow_down_m,
          Field{"slow_down_m",
                "Distance before the end of an open route at which the robot begins to slow down.", 0, 5});
    visit(self.min_speed_m_s, Field{"min_speed_m_s", "Minimum speed while slowing down.", 0, 1});
  }
};

/// Steers at a point of the route ahead, on the circle that reaches it (Coulter, "Implementation of the Pure
/// Pursuit Path Tracking Algorithm", CMU-RI-TR-92-01). The baseline controller. O(log points).
[[nodiscard]] VelocityCommand pure_pursuit(const Route& route, const SE2& map_T_base,
                                           const RouteProgress& progress,
                                           const PurePursuitOptions& options = {});

}  // namespace waymark
