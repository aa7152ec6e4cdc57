#include "waymark/replay/speed_profile.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/route_shapes.hpp"

namespace waymark {
namespace {

using test::shaped_route;

TEST(SpeedProfile, KeepsTheLimitsOfCurvesAndAcceleration) {
  const ProfileOptions options{.speed_m_s = 1.5};
  for (const char* shape : {"eight", "circle", "line"}) {
    const Route route = with_speed_profile(shaped_route(shape, 0.4), options);
    const std::size_t n = route.points.size();
    for (std::size_t i = 0; i < n; ++i) {
      const RoutePoint& a = route.points[i];
      const double v = a.speed_m_s;
      EXPECT_LE(v * v * std::abs(a.curvature_1_m), options.lateral_acceleration_m_s2 + 1e-9);
      EXPECT_LE(v * std::abs(a.curvature_1_m), options.turning_rad_s + 1e-9);
      if (i + 1 == n && !route.closed) continue;
      const RoutePoint& b = route.points[(i + 1) % n];
      const double way = i + 1 < n ? b.arc_length_m - a.arc_length_m : route.length_m - a.arc_length_m;
      const double gained = (b.speed_m_s * b.speed_m_s - v * v) / (2 * way);
      EXPECT_LE(gained, options.acceleration_m_s2 + 1e-9) << shape << i;
      EXPECT_GE(gained, -options.deceleration_m_s2 - 1e-9) << shape << i;
    }
  }
  EXPECT_NEAR(with_speed_profile(shaped_route("line", 0.4), options).points.back().speed_m_s, 0.05, 1e-12);
}

/// This includes the end of a route, where the crawl speed would be higher.
TEST(SpeedProfile, NeverExceedsTheRequestedSpeed) {
  const ProfileOptions options{.speed_m_s = 0.02};
  for (const char* shape : {"eight", "line"})
    for (const RoutePoint& point : with_speed_profile(shaped_route(shape, 0.4), options).points)
      EXPECT_LE(std::abs(point.speed_m_s), 0.02 + 1e-12) << shape;
}

}  // namespace
}  // namespace waymark
