// Tests which part of a lap becomes the route: one loop of a repeated lap, otherwise the whole lap.
#include "waymark/replay/route_builder.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/route_shapes.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

using test::circle_lap;

constexpr double kPi = std::numbers::pi;
constexpr double kStep_m = 0.01;

/// A drive made of straight segments and arcs, with noise of 4 mm and 0.5 degrees in each pose.
class Drive {
 public:
  Drive& ahead(double metres) { return arc(metres, 0); }
  /// Turns along a circle of this radius; positive angles are to the left.
  Drive& turn(double angle_rad, double radius_m) {
    return arc(std::abs(angle_rad) * radius_m, std::copysign(1 / radius_m, angle_rad));
  }
  Drive& aside(double metres) {
    length_m_ += std::abs(metres);
    at_ = at_ * SE2(0, metres, 0);
    return *this;
  }
  [[nodiscard]] const Trajectory& trajectory() const { return driven_; }
  [[nodiscard]] double length_m() const { return length_m_; }

 private:
  Drive& arc(double metres, double curvature_1_m) {
    length_m_ += metres;
    const auto steps = static_cast<int>(std::lround(metres / kStep_m));
    for (int i = 0; i < steps; ++i) {
      at_ = at_ * SE2::exp({metres / steps, 0, metres / steps * curvature_1_m});
      const SE2 noise{random_.normal(0, 0.004), random_.normal(0, 0.004), random_.normal(0, 0.009)};
      const Duration stamp(static_cast<std::int64_t>(driven_.size()) * 33'000'000);
      driven_.push_back({SensorTime(stamp), lift(at_ * noise)});
    }
    return *this;
  }

  Random random_{3};
  SE2 at_{};
  Trajectory driven_{};
  double length_m_ = 0;
};

/// A stadium with 4 m straights and a 1 m radius, driven once counter-clockwise (+1) or clockwise (-1).
constexpr double kStadium_m = 8 + 2 * kPi;
void stadium(Drive& drive, double side = 1) {
  drive.ahead(4).turn(side * kPi, 1).ahead(4).turn(side * kPi, 1);
}

BuiltRoute route_of(const Drive& drive, const RouteOptions& options = {}) {
  auto route = build_route(drive.trajectory(), options);
  EXPECT_TRUE(route) << to_string(route.error());
  return route ? *std::move(route) : BuiltRoute();
}

TEST(RouteOfALap, RepeatedLapsGiveOneLoop) {
  for (int laps = 1; laps <= 3; ++laps) {
    Drive drive;
    for (int i = 0; i < laps; ++i) stadium(drive);
    const BuiltRoute route = route_of(drive);
    EXPECT_TRUE(route.closed) << laps;
    EXPECT_NEAR(route.length_m, kStadium_m, 0.15) << laps;
    EXPECT_NEAR(route.repeated_m, (laps - 1) * kStadium_m, 0.3) << laps;
  }
}

TEST(RouteOfALap, ALapBeyondItsStartIsClosed) {
  for (const double beyond_m : {0.1, 0.4, 1.0, 2.5}) {
    Drive drive;
    stadium(drive);
    drive.aside(0.15).ahead(beyond_m);
    const BuiltRoute route = route_of(drive);
    EXPECT_TRUE(route.closed) << beyond_m;
    EXPECT_NEAR(route.length_m, kStadium_m, 0.15) << beyond_m;
    EXPECT_NEAR(route.repeated_m, drive.length_m() - kStadium_m, 0.1) << beyond_m;
  }
}

TEST(RouteOfALap, TrajectoryJumpsDoNotPreventClosing) {
  Drive drive;
  stadium(drive);
  drive.ahead(0.4).aside(0.35).ahead(0.4).aside(-0.35).ahead(0.4);
  EXPECT_TRUE(route_of(drive).closed);
}

TEST(RouteOfALap, ALapThatEndsJustBeforeItsStartIsClosed) {
  Drive drive;
  drive.ahead(4).turn(kPi, 1).ahead(4).turn(0.95 * kPi, 1);
  const BuiltRoute route = route_of(drive);
  EXPECT_TRUE(route.closed);
  EXPECT_NEAR(route.length_m, kStadium_m, 0.15);
}

TEST(RouteOfALap, BothLoopsBesideASharedStraightAreKept) {
  Drive drive;
  stadium(drive, 1);
  stadium(drive, -1);
  const BuiltRoute route = route_of(drive);
  EXPECT_TRUE(route.closed);
  EXPECT_NEAR(route.length_m, 2 * kStadium_m, 0.3);
  EXPECT_NEAR(route.repeated_m, 0, 0.15);
  Drive again;
  for (const double side : {1.0, -1.0, 1.0, -1.0}) stadium(again, side);
  EXPECT_NEAR(route_of(again).length_m, 2 * kStadium_m, 0.3)
      << "driven twice, but included in the route once";
  Drive one_more;
  for (const double side : {1.0, 1.0, -1.0}) stadium(one_more, side);
  EXPECT_NEAR(route_of(one_more).length_m, 3 * kStadium_m, 0.45) << "in the order in which it was driven";
}

TEST(RouteOfALap, ADriveBackPastTheStartStaysOpen) {
  Drive drive;
  drive.ahead(6).turn(kPi, 0.4).ahead(8).turn(kPi, 0.4);
  const BuiltRoute route = route_of(drive);
  EXPECT_FALSE(route.closed);
  EXPECT_NEAR(route.length_m, drive.length_m(), 0.15);
  EXPECT_EQ(route.repeated_m, 0);
}

TEST(RouteOfALap, AFigureEightThatStartsAtItsCrossingIsKept) {
  Drive drive;
  drive.ahead(1).turn(1.5 * kPi, 1).ahead(2).turn(-1.5 * kPi, 1).ahead(1);
  const BuiltRoute route = route_of(drive);
  EXPECT_TRUE(route.closed);
  EXPECT_NEAR(route.length_m, drive.length_m(), 0.15);
}

TEST(RouteOfALap, ALapThatEndsElsewhereStaysOpen) {
  Drive drive;
  stadium(drive);
  drive.ahead(0.5).turn(-kPi / 2, 0.5).ahead(2);
  const BuiltRoute route = route_of(drive);
  EXPECT_FALSE(route.closed);
  EXPECT_NEAR(route.length_m, drive.length_m(), 0.15);
}

TEST(RouteOfALap, WithoutAClosingDistanceNothingIsCut) {
  Drive drive;
  stadium(drive);
  stadium(drive);
  const BuiltRoute route = route_of(drive, {.closing_distance_m = 0});
  EXPECT_FALSE(route.closed);
  EXPECT_NEAR(route.length_m, 2 * kStadium_m, 0.3);
}

TEST(RouteBuilder, ANoisyLapGivesASmoothClosedCircle) {
  const auto route = build_route(circle_lap(0.01, 1.1));
  ASSERT_TRUE(route);
  EXPECT_TRUE(route->closed);
  EXPECT_NEAR(route->length_m, 4 * kPi, 0.15);
  for (const RoutePoint& point : route->points) {
    EXPECT_NEAR(point.map_T_base.translation().norm(), 2.0, 0.03);
    EXPECT_NEAR(point.curvature_1_m, 0.5, 0.5);
  }
}

TEST(RouteBuilder, DoesNotCutCornersWithoutNoise) {
  const auto route = build_route(circle_lap(0, 1.05));
  ASSERT_TRUE(route);
  for (const RoutePoint& point : route->points)
    EXPECT_NEAR(point.map_T_base.translation().norm(), 2.0, 0.003);
}

TEST(RouteBuilder, HalfALapStaysOpen) {
  const auto route = build_route(circle_lap(0.005, 0.5));
  ASSERT_TRUE(route);
  EXPECT_FALSE(route->closed);
  EXPECT_NEAR(route->length_m, 2 * kPi, 0.1);
}

TEST(RouteBuilder, AStandstillIsRejected) {
  const auto route = build_route(circle_lap(0.001, 0.001));
  ASSERT_FALSE(route);
  EXPECT_EQ(route.error().code, ErrorCode::InvalidArgument);
  testing::expect_on_page("replay", route.error());
  EXPECT_FALSE(build_route({}));
}

}  // namespace
}  // namespace waymark
