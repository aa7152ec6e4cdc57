#pragma once

#include "waymark/base/fields.hpp"
#include "waymark/samples/route.hpp"

namespace waymark {

struct ProfileOptions {
  double speed_m_s = 0;
  double lateral_acceleration_m_s2 = 0.6;
  double acceleration_m_s2 = 0.5;
  double deceleration_m_s2 = 0.5;
  double turning_rad_s = 1.2;
  double crawl_m_s = 0.05;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.speed_m_s,
          Field{"speed_m_s", "Maximum speed along the route; 0: the speed stored in the route.", 0, 10});
    visit(self.lateral_acceleration_m_s2,
          Field{"lateral_acceleration_m_s2",
                "Maximum lateral acceleration, which limits the speed in curves.", 0.01, 20});
    visit(self.acceleration_m_s2,
          Field{"acceleration_m_s2", "Maximum acceleration along the route.", 0.01, 20});
    visit(self.deceleration_m_s2,
          Field{"deceleration_m_s2", "Maximum deceleration along the route.", 0.01, 20});
    visit(self.turning_rad_s,
          Field{"turning_rad_s", "Maximum yaw rate, which limits the speed in curves.", 0.05, 20});
    visit(self.crawl_m_s,
          Field{"crawl_m_s",
                "Minimum speed of the profile, and the speed over the last centimetre before a "
                "standstill; never more than speed_m_s.",
                0.01, 1});
  }
};

/// Sets the speed at each point to the requested speed, reduced in curves (sqrt(a / curvature), yaw rate)
/// and, before and after them, by the acceleration limits (forward-backward pass: Bobrow, Dubowsky and
/// Gibson, "Time-Optimal Control of Robotic Manipulators Along Specified Paths", IJRR 4(3), 1985, for a limit
/// that does not depend on the speed). The speed is zero at the end of an open route and at changes of
/// direction; a closed route has no stop. The sign of the speed (negative: backwards) is kept. O(points).
[[nodiscard]] Route with_speed_profile(Route route, const ProfileOptions& options);

/// Signed speed at an arc length on the segment after point `index`.
[[nodiscard]] double speed_at(const Route& route, std::size_t index, double arc_length_m);

/// Time to drive a profile with a flying start.
[[nodiscard]] double duration_s(const Route& route);

}  // namespace waymark
