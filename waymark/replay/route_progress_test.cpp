#include "waymark/replay/route_progress.hpp"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/route_shapes.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/replay/speed_profile.hpp"

namespace waymark {
namespace {

using test::circle_lap;

constexpr double kPi = std::numbers::pi;

TEST(RouteProgress, SignedCrossTrackAndHeading) {
  const auto route = build_route(circle_lap(0, 1.05));
  const SE2 inside(1.9, 0, kPi / 2 + 0.1);  // left of a counter-clockwise circle, turned to the left
  const RouteProgress progress = locate(*route, inside);
  EXPECT_NEAR(progress.cross_track_m, 0.1, 0.005);
  EXPECT_NEAR(progress.heading_error_rad, 0.1, 0.01);
}

TEST(RouteProgress, IsContinuousOverTwoLaps) {
  const auto route = build_route(circle_lap(0, 1.05));
  RouteProgress progress = locate(*route, SE2(2, 0, kPi / 2));
  double travelled = 0;
  double last = progress.arc_length_m;
  for (int i = 1; i <= 400; ++i) {
    const double angle = 4 * kPi * i / 400;  // two laps
    progress = advance(*route, SE2(2 * std::cos(angle), 2 * std::sin(angle), angle + kPi / 2), progress);
    double step = progress.arc_length_m - last;
    if (step < -route->length_m / 2) step += route->length_m;
    EXPECT_NEAR(step, 8 * kPi / 400, 0.02) << i;
    travelled += step;
    last = progress.arc_length_m;
  }
  EXPECT_NEAR(travelled, 8 * kPi, 0.1);
}

/// One metre forwards, then one metre back to the start.
Route there_and_back() {
  Route route{.length_m = 2};
  for (int i = 0; i <= 40; ++i) {
    const double x = i <= 20 ? 0.05 * i : 0.05 * (40 - i);
    route.points.push_back({SE2(x, 0, 0), 0.05 * i, 0, i <= 20 ? 0.3 : -0.3});
  }
  return route;
}

TEST(RouteProgress, OvershootingATurningPointBeginsTheNextLeg) {
  const Route route = there_and_back();
  RouteProgress progress = locate(route, SE2(0.01, 0, 0));
  EXPECT_NEAR(progress.leg_end_m, 1, 1e-9);
  double x = 0.01;
  for (; x < 0.975; x += 0.01) progress = advance(route, SE2(x, 0, 0), progress);
  EXPECT_NEAR(progress.leg_end_m, 1, 1e-9) << "has not reached the turning point yet";
  for (; x < 1.05; x += 0.01) progress = advance(route, SE2(x, 0, 0), progress);
  EXPECT_NEAR(progress.leg_begin_m, 1, 1e-9);
  EXPECT_NEAR(progress.leg_end_m, 2, 1e-9);
  EXPECT_LT(speed_at(route, progress.index, progress.arc_length_m), 0) << "the next leg is driven backwards";
  for (; x > -0.05; x -= 0.01) progress = advance(route, SE2(x, 0, 0), progress);
  EXPECT_NEAR(progress.arc_length_m, 2, 1e-9) << "clamped to the end of the route";
}

// Stations along a route: each is served once per pass, in order, for its dwell time.

Route route_with(std::vector<Station> stations, bool closed) {
  Route route{.closed = closed, .length_m = 10};
  route.stations = std::move(stations);
  return route;
}

/// Drives in steps of 1 cm or stops for 0.1 s; returns the stations served with the number of steps spent
/// there, such as "shelf 5".
std::vector<std::string> served(StationStops stops, double from_m, double to_m) {
  std::vector<std::string> all;
  stops.begin(from_m);
  int stopped_steps = 0;
  for (double way_m = from_m; way_m < to_m;) {
    const Station* const before = stops.current();
    const std::string name = before != nullptr ? before->name : "";
    if (before == nullptr) {
      way_m += 0.01;
      stops.arrive(way_m, 0.01);
      stopped_steps = 0;
      continue;
    }
    stops.dwell(0.1);
    ++stopped_steps;
    if (stops.current() == nullptr) all.push_back(name + " " + std::to_string(stopped_steps));
  }
  return all;
}

TEST(StationStops, ServesEachStationOncePerPass) {
  const std::vector<Station> two = {{"shelf", 3, 0.45}, {"door", 7, 0.95}};
  EXPECT_EQ(served(StationStops(route_with(two, false)), 0, 10),
            (std::vector<std::string>{"shelf 5", "door 10"}));
  EXPECT_EQ(served(StationStops(route_with(two, true)), 0, 25),
            (std::vector<std::string>{"shelf 5", "door 10", "shelf 5", "door 10", "shelf 5"}));
  EXPECT_EQ(served(StationStops(route_with(two, true)), 4, 12), (std::vector<std::string>{"door 10"}));
  EXPECT_TRUE(served(StationStops(route_with({}, true)), 0, 25).empty());
}

TEST(StationStops, ServesAStationAtTheLapEndOncePerLap) {
  for (const double arc_m : {0.0, 9.95, 10.0}) {
    const StationStops stops(route_with({{"end", arc_m, 0.45}}, true));
    EXPECT_EQ(served(stops, 0, 10.5), (std::vector<std::string>{"end 5"})) << arc_m;
    EXPECT_EQ(served(stops, 0, 30.5).size(), 3U) << arc_m;
  }
}

TEST(StationStops, ReturnsTheDistanceToTheNextStation) {
  StationStops stops(route_with({{"shelf", 3, 1}}, false));
  EXPECT_TRUE(std::isinf(StationStops().left_m(0)));
  stops.begin(0);
  EXPECT_NEAR(stops.left_m(1), 2, 1e-12);
  stops.arrive(2.98, 0.01);
  EXPECT_EQ(stops.current(), nullptr);
  stops.arrive(2.995, 0.01);
  ASSERT_NE(stops.current(), nullptr);
  EXPECT_EQ(stops.left_s(), 1);
  stops.dwell(2);
  EXPECT_TRUE(std::isinf(stops.left_m(3)));
}

TEST(StationStops, DoesNotServeStationsBehindTheResumePoint) {
  StationStops stops(route_with({{"shelf", 3, 1}, {"door", 7, 1}}, false));
  stops.begin(0);
  stops.begin(5);
  EXPECT_NEAR(stops.left_m(5), 2, 1e-12);
  stops.arrive(7, 0.01);
  stops.begin(7.02);  // after a pause, the robot is still at the station
  ASSERT_NE(stops.current(), nullptr);
  stops.dwell(2);
  stops.begin(6.98);
  EXPECT_TRUE(std::isinf(stops.left_m(6.98))) << "not served again";
}

}  // namespace
}  // namespace waymark
