#include "waymark/config/route_file.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

Route some_route(bool closed) {
  Random random(5);
  Route route{.closed = closed};
  for (int i = 0; i < 40; ++i) {
    route.points.push_back({.map_T_base = SE2(random.normal(), random.normal(), random.uniform(-3.14, 3.14)),
                            .arc_length_m = 0.05 * i,
                            .curvature_1_m = random.normal(),
                            .speed_m_s = random.uniform(0.1, 1)});
  }
  route.length_m = route.points.back().arc_length_m + (closed ? 0.03 : 0.0);
  return route;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

std::string error_of(const std::string& text) {
  const auto route = parse_route(text, "r.yaml");
  return route ? "none" : to_string(route.error());
}

TEST(RouteFile, WhatIsWrittenReadsBack) {
  for (const bool closed : {true, false}) {
    const Route route = some_route(closed);
    const auto path = testing::fresh_folder("route") / "route.yaml";
    ASSERT_TRUE(write_route(path, route));
    const auto back = read_route(path);
    ASSERT_TRUE(back) << to_string(back.error());
    EXPECT_EQ(back->closed, closed);
    EXPECT_EQ(back->length_m, route.length_m);
    ASSERT_EQ(back->points.size(), route.points.size());
    for (std::size_t i = 0; i < route.points.size(); ++i) {
      EXPECT_EQ(back->points[i].arc_length_m, route.points[i].arc_length_m);
      EXPECT_EQ(back->points[i].map_T_base.translation(), route.points[i].map_T_base.translation());
      EXPECT_NEAR(back->points[i].map_T_base.yaw(), route.points[i].map_T_base.yaw(), 1e-15);
      EXPECT_EQ(back->points[i].curvature_1_m, route.points[i].curvature_1_m);
      EXPECT_EQ(back->points[i].speed_m_s, route.points[i].speed_m_s);
    }
  }
}

TEST(RouteFile, BadInputIsAnsweredWithFileLineAndKey) {
  const std::string text = to_yaml(some_route(true));
  EXPECT_NE(error_of("points: []").find("not a route of Waymark"), std::string::npos);
  EXPECT_NE(error_of(replaced(text, "length_m: ", "lenght_m: ")).find("r.yaml:4 (lenght_m): unknown key"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "  - [", "  - [1, ")).find("r.yaml:7 (points[0]): 7 numbers where 6"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "  - [0.05,", "  - [0.0,")).find("(points[1]): the arc length"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "  - [0.05,", "  - [0.05, 1e300, 1, 1, 1, 1] # "))
                .find("out of all proportion"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "length_m: ", "length_m: -")).find("does not fit"), std::string::npos);
  EXPECT_NE(error_of("format: waymark-route-1\nclosed: true\nlength_m: 1\npoints: []\n").find("two points"),
            std::string::npos);
}

TEST(RouteFile, NoNanIsWritten) {
  Route route = some_route(false);
  route.points[3].curvature_1_m = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(write_route(testing::fresh_folder("route") / "route.yaml", route));
}

TEST(RouteFile, StationsComeBackAndMistakesAreNamed) {
  Route route{.length_m = 2};
  route.points = {{SE2(), 0, 0, 0.3}, {SE2(2, 0, 0), 2, 0, 0.3}};
  route.stations = {{"shelf", 0.5, 3}, {"door: \"left\", {1}", 1.25, 0}};
  const auto back = parse_route(to_yaml(route), "route.yaml");
  ASSERT_TRUE(back) << to_string(back.error());
  ASSERT_EQ(back->stations.size(), 2U);
  EXPECT_EQ(back->stations[1].name, route.stations[1].name);
  EXPECT_EQ(back->stations[0].arc_length_m, 0.5);
  EXPECT_EQ(back->stations[0].pause_s, 3);

  const auto message = [&](const std::string& stations) {
    const std::string text = to_yaml(Route{.points = route.points, .length_m = 2});
    const auto read = parse_route(text + "stations: " + stations + "\n", "route.yaml");
    EXPECT_FALSE(read);
    return read ? "" : to_string(read.error());
  };
  EXPECT_NE(message("[{name: a, arc_length_m: 3, pause_s: 1}]").find("is not on a route of 2.00 m"),
            std::string::npos);
  EXPECT_NE(message("[{name: a, arc_length_m: 1, pause_s: -1}]").find("a pause of -1 s"), std::string::npos);
  EXPECT_NE(message("[{name: a, arc_length_m: 1, pause: 1}]").find("unknown key 'pause'"), std::string::npos);
  EXPECT_NE(message("{a: 1}").find("stations are a list"), std::string::npos);
  EXPECT_NE(message("[{name: a, arc_length_m: 1, pause_s: 1}, {name: a, arc_length_m: 1.5, pause_s: 1}]")
                .find("two stations are called 'a'"),
            std::string::npos);
  EXPECT_NE(message("[{name: a, arc_length_m: 1, pause_s: 1}, {name: b, arc_length_m: 0.5, pause_s: 1}]")
                .find("does not grow"),
            std::string::npos);
}

}  // namespace
}  // namespace waymark
