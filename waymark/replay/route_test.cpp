#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/replay/pure_pursuit.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/replay/route_progress.hpp"
#include "waymark/replay/speed_profile.hpp"

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;

/// A drive round a circle of radius 2 with 1 cm of noise, a little further than once round, standing still at
/// both ends.
Trajectory noisy_lap(double sigma_m, double turns) {
  Random random(1);
  Trajectory trajectory;
  const auto add = [&](double angle) {
    const SE2 pose{2 * std::cos(angle) + sigma_m * random.normal(),
                   2 * std::sin(angle) + sigma_m * random.normal(), angle + kPi / 2};
    trajectory.push_back(
        {SensorTime(Duration(static_cast<std::int64_t>(trajectory.size()) * 33'000'000)), lift(pose)});
  };
  for (int i = 0; i < 60; ++i) add(0);
  for (int i = 0; i < 1200; ++i) add(2 * kPi * turns * i / 1200);
  for (int i = 0; i < 60; ++i) add(2 * kPi * turns);
  return trajectory;
}

TEST(RouteBuilder, ANoisyLapBecomesASmoothClosedCircle) {
  const auto route = build_route(noisy_lap(0.01, 1.1));
  ASSERT_TRUE(route);
  EXPECT_TRUE(route->closed);
  EXPECT_NEAR(route->length_m, 4 * kPi, 0.15);
  for (const RoutePoint& point : route->points) {
    EXPECT_NEAR(point.map_T_base.translation().norm(), 2.0, 0.03);
    EXPECT_NEAR(point.curvature_1_m, 0.5, 0.5);
  }
}

TEST(RouteBuilder, WithoutNoiseNothingIsCut) {
  const auto route = build_route(noisy_lap(0, 1.05));
  ASSERT_TRUE(route);
  for (const RoutePoint& point : route->points)
    EXPECT_NEAR(point.map_T_base.translation().norm(), 2.0, 0.003);
}

TEST(RouteBuilder, HalfALapStaysOpen) {
  const auto route = build_route(noisy_lap(0.005, 0.5));
  ASSERT_TRUE(route);
  EXPECT_FALSE(route->closed);
  EXPECT_NEAR(route->length_m, 2 * kPi, 0.1);
}

TEST(RouteBuilder, StandingStillIsNoRoute) {
  const auto route = build_route(noisy_lap(0.001, 0.001));
  ASSERT_FALSE(route);
  EXPECT_NE(route.error().message.find("too short"), std::string::npos);
  EXPECT_FALSE(build_route({}));
}

TEST(RouteProgress, SignedCrossTrackAndHeading) {
  const auto route = build_route(noisy_lap(0, 1.05));
  const SE2 inside(1.9, 0, kPi / 2 + 0.1);  // left of a counter-clockwise circle, turned left
  const RouteProgress progress = locate(*route, inside);
  EXPECT_NEAR(progress.cross_track_m, 0.1, 0.005);
  EXPECT_NEAR(progress.heading_error_rad, 0.1, 0.01);
}

TEST(RouteProgress, GoesRoundWithoutAJump) {
  const auto route = build_route(noisy_lap(0, 1.05));
  RouteProgress progress = locate(*route, SE2(2, 0, kPi / 2));
  double travelled = 0;
  double last = progress.arc_length_m;
  for (int i = 1; i <= 400; ++i) {
    const double angle = 4 * kPi * i / 400;  // twice round
    progress = advance(*route, SE2(2 * std::cos(angle), 2 * std::sin(angle), angle + kPi / 2), progress);
    double step = progress.arc_length_m - last;
    if (step < -route->length_m / 2) step += route->length_m;
    EXPECT_NEAR(step, 8 * kPi / 400, 0.02) << i;
    travelled += step;
    last = progress.arc_length_m;
  }
  EXPECT_NEAR(travelled, 8 * kPi, 0.1);
}

/// A metre ahead, then a metre back to the start.
Route there_and_back() {
  Route route{.length_m = 2};
  for (int i = 0; i <= 40; ++i) {
    const double x = i <= 20 ? 0.05 * i : 0.05 * (40 - i);
    route.points.push_back({SE2(x, 0, 0), 0.05 * i, 0, i <= 20 ? 0.3 : -0.3});
  }
  return route;
}

TEST(RouteProgress, WhoDrivesBeyondATurningPointIsOnTheNextLeg) {
  const Route route = there_and_back();
  RouteProgress progress = locate(route, SE2(0.01, 0, 0));
  EXPECT_NEAR(progress.leg_end_m, 1, 1e-9);
  double x = 0.01;
  for (; x < 0.975; x += 0.01) progress = advance(route, SE2(x, 0, 0), progress);
  EXPECT_NEAR(progress.leg_end_m, 1, 1e-9) << "not yet there";
  for (; x < 1.05; x += 0.01) progress = advance(route, SE2(x, 0, 0), progress);
  EXPECT_NEAR(progress.leg_begin_m, 1, 1e-9);
  EXPECT_NEAR(progress.leg_end_m, 2, 1e-9);
  EXPECT_LT(speed_at(route, progress.index, progress.arc_length_m), 0) << "backwards from there";
  for (; x > -0.05; x -= 0.01) progress = advance(route, SE2(x, 0, 0), progress);
  EXPECT_NEAR(progress.arc_length_m, 2, 1e-9) << "beyond the end it is at the end";
}

TEST(PurePursuit, SteersTowardsTheRoute) {
  const auto route = build_route(noisy_lap(0, 1.05));
  const auto command = [&](const SE2& pose) { return pure_pursuit(*route, pose, locate(*route, pose)); };
  EXPECT_NEAR(command(SE2(2, 0, kPi / 2)).yaw_rate_rad_s, 0.3 * 0.5, 0.01) << "on the circle: its curvature";
  EXPECT_LT(command(SE2(1.9, 0, kPi / 2)).yaw_rate_rad_s, 0.0) << "inside: to the right";
  EXPECT_GT(command(SE2(2.1, 0, kPi / 2)).yaw_rate_rad_s, 0.3) << "outside: to the left";
}

}  // namespace
}  // namespace waymark
