// Tests which routes a replay can drive: not sideways, and not too close to tags.
#include "waymark/replay/route_checks.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/route_shapes.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using test::shaped_route;

/// The route with its headings turned to the left, between two arc lengths.
Route turned(Route route, double angle_rad, double from_m = 0, double to_m = 1e9) {
  for (RoutePoint& point : route.points) {
    if (point.arc_length_m < from_m || point.arc_length_m > to_m) continue;
    const SE2& at = point.map_T_base;
    point.map_T_base = SE2(at.x(), at.y(), at.yaw() + angle_rad);
  }
  return route;
}

/// 2 m forwards, then 1 m back.
Route there_and_back() {
  Route route;
  for (int i = 0; i <= 60; ++i) {
    const double x_m = i <= 40 ? 0.05 * i : 2 - 0.05 * (i - 40);
    route.points.push_back({SE2(x_m, 0, 0), 0.05 * i, 0, i <= 40 ? 0.3 : -0.3});
  }
  route.length_m = route.points.back().arc_length_m;
  return route;
}

TEST(DrivingHeadings, FollowTheDirectionOfMotion) {
  for (const char* shape : {"line", "circle", "eight"}) {
    for (const double speed_m_s : {0.3, -0.3}) {
      const Route route = shaped_route(shape, speed_m_s);
      const std::vector<double> headings = driving_headings(turned(route, 1.0));
      ASSERT_EQ(headings.size(), route.points.size());
      for (std::size_t i = 0; i < headings.size(); ++i)
        EXPECT_NEAR(std::remainder(headings[i] - route.points[i].map_T_base.yaw(), 2 * std::numbers::pi), 0,
                    0.03)
            << shape << " " << speed_m_s << " " << i;
    }
  }
}

TEST(DrivingHeadings, KeepTheHeadingAtATurningPoint) {
  const Route route = there_and_back();
  for (const RoutePoint& point : facing_along(route).points) EXPECT_NEAR(point.map_T_base.yaw(), 0, 1e-12);
}

TEST(SidewaysMotion, TwentyDegreesAreTheLimit) {
  for (const char* shape : {"line", "circle", "eight"}) {
    for (const double speed_m_s : {0.3, -0.3}) {
      const Route route = shaped_route(shape, speed_m_s);
      for (const double angle_deg : {0.0, 15.0, -15.0})
        EXPECT_FALSE(sideways_motion(turned(route, to_radians(angle_deg)))) << shape << " " << angle_deg;
      for (const double angle_deg : {30.0, -30.0, 90.0, -90.0, 135.0}) {
        const auto found = sideways_motion(turned(route, to_radians(angle_deg)));
        ASSERT_TRUE(found) << shape << " " << angle_deg;
        EXPECT_NEAR(to_degrees(found->angle_rad), angle_deg, 3);
        EXPECT_NEAR(found->length_m, route.length_m, 0.06);
        EXPECT_EQ(found->point, 0U);
      }
    }
  }
}

TEST(SidewaysMotion, ThePartAndItsPlaceAreNamed) {
  const Route route = turned(there_and_back(), to_radians(-90), 0.98, 1.52);
  const auto found = sideways_motion(route);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->arc_length_m, 1.0, 1e-9);
  EXPECT_NEAR(found->length_m, 0.55, 1e-9);
  EXPECT_EQ(found->point, 20U);
  const Status refused = check_sideways(route, "map/route.yaml");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
  EXPECT_EQ(refused.error().place.source, "map/route.yaml");
  EXPECT_EQ(refused.error().place.key, "points[20]");
  testing::expect_on_page("replay", refused.error());
  EXPECT_TRUE(check_sideways(there_and_back(), "map/route.yaml"));
}

TEST(SidewaysMotion, ReversingIsNotSideways) {
  EXPECT_FALSE(sideways_motion(there_and_back()));
  EXPECT_TRUE(sideways_motion(turned(there_and_back(), std::numbers::pi, 2.5)))
      << "it faces where it reverses to";
}

/// A square whose corners are driven by turning on the spot; each point faces the next one.
TEST(SidewaysMotion, CornersAreNotSideways) {
  for (const double step_m : {0.05, 0.5}) {
    Route route;
    const int steps = static_cast<int>(std::lround(2 / step_m));
    SE2 at;
    for (int side = 0; side < 4; ++side, at = at * SE2(0, 0, std::numbers::pi / 2)) {
      for (int i = 0; i < steps; ++i, at = at * SE2(step_m, 0, 0))
        route.points.push_back({at, step_m * static_cast<double>(route.points.size()), 0, 0.3});
    }
    route.closed = true;
    route.length_m = 8;
    EXPECT_FALSE(sideways_motion(route)) << step_m;
  }
}

/// 1 m along x, then 1 m to the left; the heading at the corner is given.
Route with_corner(double yaw_rad) {
  Route route;
  for (int i = 0; i <= 40; ++i) {
    const SE2 pose = i < 20    ? SE2(0.05 * i, 0, 0)
                     : i == 20 ? SE2(1, 0, yaw_rad)
                               : SE2(1, 0.05 * (i - 20), std::numbers::pi / 2);
    route.points.push_back({pose, 0.05 * i, 0, 0.3});
  }
  route.length_m = 2;
  return route;
}

TEST(SidewaysMotion, AtACornerAnyHeadingBetweenItsDirectionsIsAhead) {
  for (const double yaw_deg : {-15.0, 0.0, 22.5, 45.0, 67.5, 90.0, 105.0})
    EXPECT_FALSE(sideways_motion(with_corner(to_radians(yaw_deg)))) << yaw_deg;
  EXPECT_NEAR(to_degrees(sideways_motion(with_corner(to_radians(-30))).value().angle_rad), -30, 1e-6);
  EXPECT_NEAR(to_degrees(sideways_motion(with_corner(to_radians(130))).value().angle_rad), 40, 1e-6);
}

TEST(SidewaysMotion, PointsThatCoincideHaveNoDirection) {
  Route route;
  for (int i = 0; i <= 20; ++i) {
    route.points.push_back({SE2(0.05 * i, 0, 0), 0.05 * i, 0, 0.3});
    route.points.push_back({SE2(0.05 * i, 1e-9, 0), 0.05 * i, 0, 0.3});
  }
  route.length_m = 1;
  EXPECT_FALSE(sideways_motion(route));
}

TEST(SidewaysMotion, ARouteWithoutLengthIsNotSideways) {
  EXPECT_FALSE(sideways_motion({}));
  EXPECT_TRUE(driving_headings({}).empty());
  Route still;
  still.points.assign(3, {SE2(1, 2, 0.5), 0, 0, 0.3});
  EXPECT_FALSE(sideways_motion(still));
  EXPECT_NEAR(facing_along(still).points[1].map_T_base.yaw(), 0.5, 1e-12);
}

constexpr Hull kHull{.front_m = 0.2, .rear_m = 0.1, .width_m = 0.2, .height_m = 0.25};

/// A tag beside a straight route along x, at this distance from the hull, facing the route.
TagMap tag_beside(double clearance_m) {
  TagMap map;
  const double y_m = kHull.width_m / 2 + clearance_m;
  const SE3 map_T_tag(SO3::from_rpy(-std::numbers::pi / 2, 0, 0), {5, y_m, 0.1});
  map.tags[{FamilyId::Tag36h11, 7}] = {map_T_tag, 0.16, {}};
  map.tags[{FamilyId::Tag36h11, 8}] = {SE3(SO3(), {20, 20, 0}), 0.16, {}};
  return map;
}

TEST(NearestTag, IsTheOneThatTheHullPassesMostClosely) {
  const auto nearest = nearest_tag(shaped_route("line", 0.3), tag_beside(0.14), kHull);
  ASSERT_TRUE(nearest);
  EXPECT_EQ(nearest->tag.number, 7);
  EXPECT_NEAR(nearest->clearance_m, 0.14, 1e-6);
  EXPECT_NEAR(nearest->arc_length_m, 5, 0.3);
  EXPECT_FALSE(nearest_tag(shaped_route("line", 0.3), {}, kHull));
}

TEST(NearestTag, ATaughtHeadingDoesNotTurnTheHullThatIsDriven) {
  const Route route = shaped_route("line", 0.3);
  EXPECT_NEAR(nearest_tag(turned(route, to_radians(15)), tag_beside(0.2), kHull)->clearance_m, 0.2, 1e-6);
}

/// The same limit in both: what the limiter stops at is reported, and nothing else.
TEST(NearestTag, TheReportAgreesWithTheLimiter) {
  const SafetyOptions options;
  for (const double clearance_m : {0.0, 0.05, 0.14, 0.1499999, 0.15, 0.1500001, 0.16, 1.0}) {
    const NearestTag nearest{
        .tag = {FamilyId::Tag36h11, 7}, .clearance_m = clearance_m, .arc_length_m = 3.71};
    const SafetyVerdict verdict =
        limit({0.2, 0}, {.localized = true, .clearance_m = clearance_m, .dt_s = 0.05}, options);
    EXPECT_EQ(describe_too_near(nearest, options).empty(), !verdict.stopped) << clearance_m;
  }
  testing::expect_on_page(
      "replay",
      describe_too_near({.tag = {FamilyId::Tag36h11, 7}, .clearance_m = 0.14, .arc_length_m = 3.71}));
}

}  // namespace
}  // namespace waymark
