// Stations of a route: each is served once a pass, in order, for its pause.
#include "waymark/replay/station_stops.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace waymark {
namespace {

Route route_with(std::vector<Station> stations, bool closed) {
  Route route{.closed = closed, .length_m = 10};
  route.stations = std::move(stations);
  return route;
}

/// Drives on by a centimetre or stands for a tenth of a second; what was served, "shelf 3.00 0.5".
std::vector<std::string> served(StationStops stops, double from_m, double to_m) {
  std::vector<std::string> all;
  stops.begin(from_m);
  int stood = 0;
  for (double way_m = from_m; way_m < to_m;) {
    const Station* const before = stops.standing();
    const std::string name = before != nullptr ? before->name : "";
    if (before == nullptr) {
      way_m += 0.01;
      stops.arrive(way_m, 0.01);
      stood = 0;
      continue;
    }
    stops.stand(0.1);
    ++stood;
    if (stops.standing() == nullptr) all.push_back(name + " " + std::to_string(stood));
  }
  return all;
}

TEST(StationStops, EachIsServedOnceAPass) {
  const std::vector<Station> two = {{"shelf", 3, 0.45}, {"door", 7, 0.95}};
  EXPECT_EQ(served(StationStops(route_with(two, false)), 0, 10),
            (std::vector<std::string>{"shelf 5", "door 10"}));
  EXPECT_EQ(served(StationStops(route_with(two, true)), 0, 25),
            (std::vector<std::string>{"shelf 5", "door 10", "shelf 5", "door 10", "shelf 5"}));
  EXPECT_EQ(served(StationStops(route_with(two, true)), 4, 12), (std::vector<std::string>{"door 10"}));
  EXPECT_TRUE(served(StationStops(route_with({}, true)), 0, 25).empty());
}

TEST(StationStops, WhereALapEndsIsServedOnceALap) {
  for (const double arc_m : {0.0, 9.95, 10.0}) {
    const StationStops stops(route_with({{"end", arc_m, 0.45}}, true));
    EXPECT_EQ(served(stops, 0, 10.5), (std::vector<std::string>{"end 5"})) << arc_m;
    EXPECT_EQ(served(stops, 0, 30.5).size(), 3U) << arc_m;
  }
}

TEST(StationStops, TheWayToTheNextOneIsKnown) {
  StationStops stops(route_with({{"shelf", 3, 1}}, false));
  EXPECT_TRUE(std::isinf(StationStops().left_m(0)));
  stops.begin(0);
  EXPECT_NEAR(stops.left_m(1), 2, 1e-12);
  stops.arrive(2.98, 0.01);
  EXPECT_EQ(stops.standing(), nullptr);
  stops.arrive(2.995, 0.01);
  ASSERT_NE(stops.standing(), nullptr);
  EXPECT_EQ(stops.left_s(), 1);
  stops.stand(2);
  EXPECT_TRUE(std::isinf(stops.left_m(3)));
}

TEST(StationStops, WhoGoesOnAfterACarryDoesNotServeWhatLiesBehind) {
  StationStops stops(route_with({{"shelf", 3, 1}, {"door", 7, 1}}, false));
  stops.begin(0);
  stops.begin(5);
  EXPECT_NEAR(stops.left_m(5), 2, 1e-12);
  stops.arrive(7, 0.01);
  stops.begin(7.02);  // somebody paused it and let it go on: it stands there still
  ASSERT_NE(stops.standing(), nullptr);
  stops.stand(2);
  stops.begin(6.98);
  EXPECT_TRUE(std::isinf(stops.left_m(6.98))) << "served is served";
}

}  // namespace
}  // namespace waymark
