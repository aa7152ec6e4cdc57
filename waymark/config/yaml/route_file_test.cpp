#include "waymark/config/yaml/route_file.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "tests/support/line_cuts.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

/// A circle of 2 m with even steps, either closed by one more step or ending where it began.
Route some_route(bool closed) {
  Random random(5);
  Route route{.closed = closed};
  constexpr double kRadius_m = 0.05 * 40 / (2 * std::numbers::pi);
  for (int i = 0; i < 40; ++i) {
    const double angle = 0.05 * i / kRadius_m;
    route.points.push_back({.map_T_base = SE2(kRadius_m * std::cos(angle), kRadius_m * std::sin(angle),
                                              random.uniform(-3.14, 3.14)),
                            .arc_length_m = 0.05 * i,
                            .curvature_1_m = random.normal(),
                            .speed_m_s = random.uniform(0.1, 1)});
  }
  route.length_m = route.points.back().arc_length_m + (closed ? 0.05 : 0.0);
  return route;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

std::string error_of(const std::string& text) {
  const auto route = parse_route(text, "r.yaml");
  return route ? "none" : to_string(route.error());
}

TEST(RouteFile, RoundTrips) {
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

TEST(RouteFile, InvalidInputIsReportedWithFileLineAndKey) {
  const std::string text = to_yaml(some_route(true));
  EXPECT_NE(error_of("points: []").find("waymark-route-1"), std::string::npos);
  EXPECT_NE(error_of(replaced(text, "length_m: ", "lenght_m: ")).find("r.yaml:4 (lenght_m): unknown key"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "  - [", "  - [1, ")).find("r.yaml:10 (points[0]): 7 numbers where 6"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "  - [0.05,", "  - [0.0,")).find("(points[1]): the arc length"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "  - [0.05,", "  - [0.05, 1e300, 1, 1, 1, 1] # "))
                .find("out of all proportion"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "length_m: ", "length_m: -")).find("does not fit"), std::string::npos);
  EXPECT_NE(error_of("format: waymark-route-1\nclosed: true\nlength_m: 1\npoints: []\n").find("(points)"),
            std::string::npos);
}

std::string without_lines(const std::string& text, std::size_t first, std::size_t last) {
  std::istringstream lines(text);
  std::string kept;
  std::string line;
  for (std::size_t number = 1; std::getline(lines, line); ++number) {
    if (number < first || number > last) kept += line + "\n";
  }
  return kept;
}

/// The file in the older format, without the values that describe its points.
std::string as_before(std::string text) {
  for (const char* key : {"point_count", "closing_gap_m", "points_checksum"}) {
    const std::size_t begin = text.find(key);
    text.erase(begin, text.find('\n', begin) + 1 - begin);
  }
  return text;
}

TEST(RouteFile, RejectsGapsAndMissingEnds) {
  const std::string text = to_yaml(some_route(true));
  EXPECT_NE(error_of(without_lines(text, 20, 30)).find("declares 40 points but contains 29"),
            std::string::npos);
  const std::string old = as_before(text);
  EXPECT_EQ(error_of(old), "none");
  const std::string hole = error_of(without_lines(old, 17, 27));
  EXPECT_NE(hole.find("a gap of 0.60 m between points 9 and 10 (at 0.45 m)"), std::string::npos) << hole;
  EXPECT_NE(hole.find("waymark map"), std::string::npos) << hole;
  const std::string end = error_of(without_lines(old, 35, 1000));
  EXPECT_NE(end.find("between the last point and the first"), std::string::npos) << end;
  EXPECT_NE(error_of(without_lines(as_before(to_yaml(some_route(false))), 35, 1000)).find("does not fit"),
            std::string::npos);
}

TEST(RouteFile, RejectsCutsAtLineEnds) {
  for (const bool closed : {true, false}) {
    Route route = some_route(closed);
    route.longest_without_tags_m = 0.5;
    route.map_tags = {{{FamilyId::Tag36h11, 3}, 1, 2}, {{FamilyId::Tag36h11, 4}, 2, 2}};
    route.stations = {{.name = "shelf", .arc_length_m = 0.5, .pause_s = 1}};
    const std::string text = to_yaml(route);
    ASSERT_EQ(error_of(text), "none");
    for (const std::string& cut : testing::cuts_at_line_ends(text)) EXPECT_NE(error_of(cut), "none") << cut;
  }
}

TEST(RouteFile, RejectsChangedPoints) {
  const Route route = some_route(true);
  const std::string text = to_yaml(route);
  Route moved = route;
  moved.points[7].speed_m_s += 0.1;
  const std::string changed = to_yaml(moved);
  const auto points_of = [](const std::string& file) { return file.substr(file.find("\npoints:")); };
  EXPECT_NE(error_of(text.substr(0, text.find("\npoints:")) + points_of(changed)).find("checksum"),
            std::string::npos);
  moved = route;
  moved.points[7].map_T_base = SE2(3, 0, 0) * moved.points[7].map_T_base;
  EXPECT_NE(error_of(as_before(to_yaml(moved))).find("the arc length increases by 0.05 m"),
            std::string::npos);
}

TEST(RouteFile, RejectsSpeedsAgainstThePoints) {
  Route route{.length_m = 0.4};
  for (int i = 0; i < 9; ++i)
    route.points.push_back({.map_T_base = SE2(0.05 * i, 0, 0), .arc_length_m = 0.05 * i, .speed_m_s = 0.3});
  EXPECT_TRUE(parse_route(to_yaml(route), "r.yaml"));
  for (RoutePoint& point : route.points) point.speed_m_s = -0.3;
  const auto wrong = parse_route(to_yaml(route), "r.yaml");
  ASSERT_FALSE(wrong);
  EXPECT_NE(
      to_string(wrong.error()).find("point 0 (at 0.00 m) is -0.3 m/s, but the point after lies ahead of it"),
      std::string::npos);
  for (int i = 0; i < 9; ++i) route.points[static_cast<std::size_t>(i)].map_T_base = SE2(-0.05 * i, 0, 0);
  EXPECT_TRUE(parse_route(to_yaml(route), "r.yaml")) << "consistently backward";
}

/// Drives forward to 0.5 m, backward to 0.2 m and forward to 0.8 m. The speed at a point is the speed with
/// which it is reached.
Route with_turning_points() {
  Route route;
  const auto add = [&](double x_m, double speed_m_s) {
    const double arc_m = route.points.empty() ? 0 : route.points.back().arc_length_m + 0.05;
    route.points.push_back({.map_T_base = SE2(x_m, 0, 0), .arc_length_m = arc_m, .speed_m_s = speed_m_s});
  };
  for (int i = 0; i <= 10; ++i) add(0.05 * i, 0.3);
  for (int i = 9; i >= 4; --i) add(0.05 * i, -0.2);
  for (int i = 5; i <= 16; ++i) add(0.05 * i, 0.3);
  route.length_m = route.points.back().arc_length_m;
  return route;
}

TEST(RouteFile, ATurningPointHasTheSpeedOfTheLegThatEndsThere) {
  const Route route = with_turning_points();
  const auto back = parse_route(to_yaml(route), "r.yaml");
  ASSERT_TRUE(back) << to_string(back.error());
  for (std::size_t i = 0; i < route.points.size(); ++i)
    EXPECT_EQ(back->points[i].speed_m_s, route.points[i].speed_m_s) << i;
}

TEST(RouteFile, RejectsAnySinglePointThatReversesAgainstItsSegment) {
  const Route right = with_turning_points();
  for (std::size_t i = 0; i < right.points.size(); ++i) {
    if (right.points[i].speed_m_s < 0) continue;
    Route wrong = right;
    wrong.points[i].speed_m_s *= -1;
    EXPECT_NE(error_of(to_yaml(wrong)).find(fmt::format("the speed of point {} ", i)), std::string::npos)
        << i;
  }
}

TEST(RouteFile, TheFirstPointOfAClosedRouteEndsItsClosingSegment) {
  Route route = some_route(true);
  for (std::size_t i = 0; i < route.points.size(); ++i) {  // heading along the circle
    const Eigen::Vector2d& map_p = route.points[i].map_T_base.translation();
    route.points[i].map_T_base =
        SE2(map_p.x(), map_p.y(), std::atan2(map_p.y(), map_p.x()) + std::numbers::pi / 2);
  }
  EXPECT_EQ(error_of(to_yaml(route)), "none");
  route.points.front().speed_m_s *= -1;
  EXPECT_NE(error_of(to_yaml(route)).find("the speed of point 0 "), std::string::npos);
}

TEST(RouteFile, RejectsARouteOfAnotherMap) {
  TagMap map;
  for (const int i : {0, 1, 2, 3})
    map.tags[{FamilyId::Tag36h11, i}] = {.map_T_tag = SE3(SO3(), {1.0 * i, 2, 0.3}), .size_m = 0.16};
  Route route = with_map(some_route(true), map);
  route.longest_without_tags_m = 0.75;
  const auto back = parse_route(to_yaml(route), "r.yaml");
  ASSERT_TRUE(back) << to_string(back.error());
  EXPECT_EQ(back->longest_without_tags_m, 0.75);
  EXPECT_TRUE(check_map(*back, map, "r.yaml"));
  TagMap extended = map;
  extended.tags[{FamilyId::Tag36h11, 9}] = map.tags.begin()->second;
  extended.tags.erase({FamilyId::Tag36h11, 0});
  EXPECT_TRUE(check_map(*back, extended, "r.yaml"))
      << "removing one tag and adding one leaves the map the same";
  TagMap other = map;
  for (auto& [id, tag] : other.tags) tag.map_T_tag = SE3(SO3(), {0, 1, 0}) * tag.map_T_tag;
  const Status refused = check_map(*back, other, "r.yaml");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().place.key, "map_tags");
  testing::expect_on_page("map", refused.error());
  EXPECT_TRUE(check_map(some_route(true), other, "r.yaml")) << "a route without stored tags is not checked";
}

TEST(RouteFile, DoesNotWriteNan) {
  Route route = some_route(false);
  route.points[3].curvature_1_m = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(write_route(testing::fresh_folder("route") / "route.yaml", route));
}

TEST(RouteFile, StationsRoundTripAndErrorsAreReported) {
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
  EXPECT_NE(message("[{name: a, arc_length_m: 1, pause_s: -1}]").find("pause of -1 s"), std::string::npos);
  EXPECT_NE(message("[{name: a, arc_length_m: 1, pause: 1}]").find("unknown key 'pause'"), std::string::npos);
  EXPECT_NE(message("{a: 1}").find("(stations)"), std::string::npos);
  EXPECT_NE(message("[{name: a, arc_length_m: 1, pause_s: 1}, {name: a, arc_length_m: 1.5, pause_s: 1}]")
                .find("duplicate station 'a'"),
            std::string::npos);
  EXPECT_NE(message("[{name: a, arc_length_m: 1, pause_s: 1}, {name: b, arc_length_m: 0.5, pause_s: 1}]")
                .find("does not increase"),
            std::string::npos);
}

}  // namespace
}  // namespace waymark
