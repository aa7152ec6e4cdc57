// Tests which part of a lap becomes the route: one loop of a repeated lap, otherwise the whole lap.
#include "waymark/replay/route_builder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/route_shapes.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/replay/route_checks.hpp"

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
  /// Moves straight in a direction relative to the heading, without turning; positive angles are to the left.
  Drive& strafe(double metres, double direction_rad) {
    length_m_ += metres;
    const auto steps = static_cast<int>(std::lround(metres / kStep_m));
    for (int i = 0; i < steps; ++i) {
      at_ = at_ * SE2(metres / steps * std::cos(direction_rad), metres / steps * std::sin(direction_rad), 0);
      add();
    }
    return *this;
  }
  Drive& spin(double angle_rad) {
    constexpr int kSteps = 40;
    for (int i = 0; i < kSteps; ++i) {
      at_ = at_ * SE2(0, 0, angle_rad / kSteps);
      add();
    }
    return *this;
  }
  /// Drives straight on and then turns along a circle of this radius, while no pose is known.
  Drive& unseen(double metres, double angle_rad, double radius_m) {
    const double arc_m = std::abs(angle_rad) * radius_m;
    length_m_ += metres + arc_m;
    at_ = at_ * SE2(metres, 0, 0) * SE2::exp({arc_m, 0, angle_rad});
    return *this;
  }
  Drive& rest(int poses) {
    for (int i = 0; i < poses; ++i) add();
    return *this;
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
      add();
    }
    return *this;
  }
  void add() {
    const SE2 noise{random_.normal(0, 0.004), random_.normal(0, 0.004), random_.normal(0, 0.009)};
    const Duration stamp(static_cast<std::int64_t>(driven_.size()) * 33'000'000);
    driven_.push_back({SensorTime(stamp), lift(at_ * noise)});
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

// The heading that was taught.

double angle_deg(double from_rad, double to_rad) {
  return to_degrees(std::remainder(to_rad - from_rad, 2 * kPi));
}

/// Largest angle between the headings of a route and those of the nearest driven poses.
double worst_heading_deg(const Route& route, const Trajectory& driven) {
  double worst_deg = 0;
  for (const RoutePoint& point : route.points) {
    const auto distance_m = [&](const StampedPose& pose) {
      return (pose.map_T_base.translation().head<2>() - point.map_T_base.translation()).norm();
    };
    const auto nearest = std::ranges::min_element(driven, {}, distance_m);
    const double taught = project_to_plane(nearest->map_T_base).yaw();
    worst_deg = std::max(worst_deg, std::abs(angle_deg(taught, point.map_T_base.yaw())));
  }
  return worst_deg;
}

/// An ellipse of 3 by 2 m, driven past its start, with the heading turned to the left of the motion.
Trajectory turned_ellipse(double angle_rad, double slowness) {
  Random random(5);
  Trajectory driven;
  const int steps = static_cast<int>(1000 * slowness);
  for (int i = 0; i < 11 * steps / 10; ++i) {
    const double t = 2 * kPi * i / steps;
    const double yaw = std::atan2(2 * std::cos(t), -3 * std::sin(t)) + angle_rad;
    const SE2 pose(3 * std::cos(t) + random.normal(0, 0.003), 2 * std::sin(t) + random.normal(0, 0.003),
                   yaw + random.normal(0, 0.005));
    driven.push_back({SensorTime(Duration(33'000'000LL * i)), lift(pose)});
  }
  return driven;
}

TEST(TaughtHeading, IsKeptInAnyDirectionOfMotion) {
  for (const double off_deg : {0.0, 5.0, 15.0, -15.0, 45.0, -90.0, 90.0, 91.0, 89.0, -135.0, 180.0}) {
    for (const double slowness : {1.0, 4.0}) {
      const Trajectory driven = turned_ellipse(to_radians(off_deg), slowness);
      const auto route = build_route(driven);
      ASSERT_TRUE(route) << to_string(route.error());
      EXPECT_TRUE(route->closed || std::abs(off_deg) > 100) << off_deg << " " << slowness;
      EXPECT_LT(worst_heading_deg(*route, driven), 5) << off_deg << " " << slowness;
      const double limit_deg = std::abs(off_deg) > 90 ? 180 - std::abs(off_deg) : std::abs(off_deg);
      EXPECT_EQ(sideways_motion(*route).has_value(), limit_deg > 20) << off_deg;
    }
  }
}

TEST(TaughtHeading, LookingAroundOnTheWayIsNotSideways) {
  Drive drive;
  for (int i = 0; i < 4; ++i) drive.ahead(1).turn(kPi / 2, 0.3).spin(kPi / 2).rest(60).spin(-kPi / 2);
  drive.ahead(0.5);
  const BuiltRoute route = route_of(drive);
  EXPECT_TRUE(route.closed);
  EXPECT_FALSE(sideways_motion(route));
}

TEST(TaughtHeading, TurnsOnTheSpotAreNotSideways) {
  for (const double turn_rad : {kPi / 2, -kPi / 2, 2.5, kPi}) {
    Drive drive;
    drive.ahead(2).rest(30).spin(turn_rad).rest(30).ahead(2);
    EXPECT_FALSE(sideways_motion(route_of(drive))) << turn_rad;
  }
}

/// The drive of a base whose origin is this far behind the given one.
Trajectory seen_behind(Trajectory driven, double behind_m) {
  for (StampedPose& pose : driven) pose.map_T_base = pose.map_T_base * lift(SE2(-behind_m, 0, 0));
  return driven;
}

TEST(TaughtHeading, TurnsAboutAPointAheadOrBehindAreNotSideways) {
  for (const double ahead_m : {0.03, 0.08, -0.08, 0.15, -0.2, 0.2}) {
    for (const double turn_deg : {90.0, -90.0, 120.0, 180.0, 360.0}) {
      Drive drive;
      drive.ahead(1).spin(to_radians(turn_deg)).ahead(1);
      const auto route = build_route(seen_behind(drive.trajectory(), ahead_m));
      ASSERT_TRUE(route) << to_string(route.error());
      EXPECT_FALSE(sideways_motion(*route)) << ahead_m << " " << turn_deg;
      for (const RoutePoint& point : route->points)
        EXPECT_GT(point.speed_m_s, 0) << ahead_m << " " << turn_deg;
    }
  }
}

TEST(TaughtHeading, SidewaysMotionIsFoundWhereverTheBaseOriginIs) {
  for (const double ahead_m : {-0.2, 0.08, 0.2}) {
    Drive drive;
    drive.ahead(1).spin(kPi / 2).ahead(1).strafe(0.4, kPi / 2).ahead(1);
    const auto route = build_route(seen_behind(drive.trajectory(), ahead_m));
    ASSERT_TRUE(route) << to_string(route.error());
    EXPECT_TRUE(sideways_motion(*route)) << ahead_m;
  }
}

/// Every n-th pose of a drive.
Trajectory every(std::size_t n, const Trajectory& driven) {
  Trajectory kept;
  for (std::size_t i = 0; i < driven.size(); i += n) kept.push_back(driven[i]);
  return kept;
}

TEST(TaughtHeading, APartWithoutPosesIsNotSideways) {
  for (const double turn_deg : {60.0, 90.0, -90.0, 120.0}) {
    for (const std::size_t n : {1U, 3U, 5U}) {
      Drive drive;
      drive.ahead(1).unseen(1, to_radians(turn_deg), 0.3).ahead(1);
      const auto route = build_route(every(n, drive.trajectory()));
      ASSERT_TRUE(route) << to_string(route.error());
      EXPECT_FALSE(sideways_motion(*route)) << turn_deg << " " << n;
    }
  }
}

/// A fast part has as long steps as a jump, but several of them.
TEST(TaughtHeading, SidewaysMotionIsFoundInAFastPart) {
  Drive drive;
  drive.ahead(2).strafe(1, kPi / 2).ahead(2);
  Trajectory driven;
  for (std::size_t i = 0; i < drive.trajectory().size(); i += i >= 200 && i < 300 ? 8 : 1)
    driven.push_back(drive.trajectory()[i]);
  const auto route = build_route(driven);
  ASSERT_TRUE(route) << to_string(route.error());
  EXPECT_TRUE(sideways_motion(*route));
}

TEST(TaughtHeading, APartThatWasDrivenSidewaysIsFound) {
  for (const double direction_rad : {kPi / 2, -kPi / 2, 0.8, -0.8}) {
    for (const double metres : {0.4, 1.0, 3.0}) {
      Drive drive;
      drive.ahead(2).strafe(metres, direction_rad).ahead(2);
      const BuiltRoute route = route_of(drive);
      const auto found = sideways_motion(route);
      ASSERT_TRUE(found) << direction_rad << " " << metres;
      EXPECT_GT(found->arc_length_m, 1.5);
      EXPECT_LT(found->arc_length_m + found->length_m, 2.6 + metres);
      EXPECT_EQ(found->angle_rad > 0, direction_rad < 0) << "the heading is to the other side of the motion";
    }
  }
}

TEST(TaughtHeading, APartThatWasDrivenDiagonallyBackIsFound) {
  Drive drive;
  drive.ahead(2).strafe(1, 2.4).ahead(2);
  EXPECT_TRUE(sideways_motion(route_of(drive)));
}

/// In no backward part does the robot move forwards; a route file with such a part is invalid.
TEST(TaughtHeading, ABackwardPartNeverLeadsForwards) {
  for (const double direction_rad : {0.6, 0.9, 1.0, -1.1, 1.2, kPi / 2}) {
    for (const double metres : {0.08, 0.3, 1.0}) {
      Drive drive;
      drive.ahead(1).strafe(1, kPi).strafe(metres, direction_rad).strafe(0.5, kPi);
      const BuiltRoute route = route_of(drive);
      for (std::size_t i = 1; i < route.points.size(); ++i) {
        if (route.points[i].speed_m_s > 0) continue;
        const Eigen::Vector2d step =
            (route.points[i - 1].map_T_base.inverse() * route.points[i].map_T_base).translation();
        EXPECT_LT(step.x(), 0.5 * step.norm()) << direction_rad << " " << metres << " " << i;
      }
    }
  }
}

TEST(TaughtHeading, ARouteThatReversesKeepsIt) {
  Drive drive;
  drive.ahead(2).rest(20).strafe(1, kPi).rest(20).ahead(1);
  const BuiltRoute route = route_of(drive);
  EXPECT_FALSE(sideways_motion(route));
  EXPECT_TRUE(std::ranges::any_of(route.points, [](const RoutePoint& p) { return p.speed_m_s < 0; }));
  for (const RoutePoint& point : route.points) EXPECT_NEAR(point.map_T_base.yaw(), 0, to_radians(5));
}

TEST(TaughtHeading, JumpsOfATrajectoryAreNotSideways) {
  Drive drive;
  stadium(drive);
  drive.ahead(0.4).aside(0.35).ahead(0.4).aside(-0.35).ahead(0.4);
  EXPECT_FALSE(sideways_motion(route_of(drive)));
  Drive open;
  open.ahead(1).aside(0.3).ahead(1).rest(500).aside(-0.3).ahead(1);
  EXPECT_FALSE(sideways_motion(route_of(open))) << "after a long standstill, too";
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
