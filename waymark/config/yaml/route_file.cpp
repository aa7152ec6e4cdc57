#include "waymark/config/yaml/route_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

#include "waymark/base/fnv1a.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_tree.hpp"

namespace waymark {
namespace {

constexpr YamlLimits kRouteLimits{.bytes = std::size_t{1} << 26U, .nodes = 4'000'000, .depth = 16};
constexpr const char* kRouteFormat = "waymark-route-1";
constexpr std::size_t kColumns = 6;

std::array<double, kColumns> row_of(const RoutePoint& point) {
  return {point.arc_length_m,     point.map_T_base.x(), point.map_T_base.y(),
          point.map_T_base.yaw(), point.curvature_1_m,  point.speed_m_s};
}

constexpr const char* kMend =
    "Points are missing or were changed: take the file from a backup (route.1.yaml, ...) or map the lap "
    "again with "
    "`waymark map`.";

std::string line_of(const RoutePoint& point) { return "  - " + yaml_list(row_of(point)) + "\n"; }

/// Checksum of all points as written in the file.
std::string checksum(const std::vector<std::array<double, kColumns>>& rows) {
  std::uint64_t hash = fnv1a("");
  for (const auto& row : rows) hash = fnv1a(yaml_list(row), hash);
  return fmt::format("{:016x}", hash);
}

std::vector<std::array<double, kColumns>> rows_of(const Route& route) {
  std::vector<std::array<double, kColumns>> rows;
  rows.reserve(route.points.size());
  for (const RoutePoint& point : route.points) rows.push_back(row_of(point));
  return rows;
}

/// Straight-line distance from the last point to the first.
double closing_gap_m(const Route& route) {
  return (route.points.front().map_T_base.translation() - route.points.back().map_T_base.translation())
      .norm();
}

double median_spacing_m(const Route& route) {
  std::vector<double> spacings;
  for (std::size_t i = 1; i < route.points.size(); ++i)
    spacings.push_back(route.points[i].arc_length_m - route.points[i - 1].arc_length_m);
  std::ranges::nth_element(spacings, spacings.begin() + static_cast<std::ptrdiff_t>(spacings.size() / 2));
  return spacings[spacings.size() / 2];
}

/// Checks that points are evenly spaced and no farther apart than their arc lengths.
Status check_spacing(const YamlCursor& points, const Route& route) {
  constexpr double kSlack_m = 0.01;
  const double most_m = 3 * median_spacing_m(route) + 0.02;
  const std::size_t count = route.points.size();
  for (std::size_t i = 1; i < count + (route.closed ? 1U : 0U); ++i) {
    const RoutePoint& before = route.points[i - 1];
    const RoutePoint& after = route.points[i % count];
    const double way_m = (i < count ? after.arc_length_m : route.length_m) - before.arc_length_m;
    const double apart_m = (after.map_T_base.translation() - before.map_T_base.translation()).norm();
    if (way_m <= most_m && apart_m <= 1.02 * way_m + kSlack_m) continue;
    const std::string where =
        i < count ? fmt::format("between points {} and {} (at {:.2f} m)", i - 1, i, before.arc_length_m)
                  : std::string("between the last point and the first");
    const auto message =
        way_m > most_m ? fmt::format("a gap of {:.2f} m {}, but the spacing is {:.2f} m elsewhere", way_m,
                                     where, median_spacing_m(route))
                       : fmt::format("{} the distance is {:.2f} m, but the arc length increases by {:.2f} m",
                                     where, apart_m, way_m);
    return points.fail_here(ErrorCode::InvalidArgument, message, kMend);
  }
  return {};
}

/// Whether the displacement, in the frame of a robot that reverses, points forward.
bool leads_forwards(const Eigen::Vector2d& displacement) {
  constexpr double kNoDirection_m = 0.005;
  return displacement.norm() >= kNoDirection_m && displacement.x() >= 0.5 * displacement.norm();
}

/// The speed of a point is that of the segment that ends there (route_progress.cpp); it is negative if the
/// robot reverses, so that the previous point is ahead of it. No segment of an open route ends at its first
/// point, which has the speed of the segment that begins there.
Status check_directions(const YamlCursor& points, const Route& route) {
  constexpr const char* kMeaning =
      "The speed of a point is that of the segment that ends there: negative if the robot reverses to it.";
  const std::size_t count = route.points.size();
  for (std::size_t i = 0; i < count; ++i) {
    const RoutePoint& point = route.points[i];
    if (!(point.speed_m_s < 0)) continue;
    const bool begins = i == 0 && !route.closed;
    const SE2& other = route.points[begins ? 1 : (i + count - 1) % count].map_T_base;
    const Eigen::Vector2d apart = (point.map_T_base.inverse() * other).translation();
    if (!leads_forwards(begins ? apart : Eigen::Vector2d(-apart))) continue;
    return points.fail_here(
        ErrorCode::InvalidArgument,
        fmt::format("the speed of point {} (at {:.2f} m) is {:g} m/s, but the point {} lies {} it", i,
                    point.arc_length_m, point.speed_m_s, begins ? "after" : "before",
                    begins ? "ahead of" : "behind"),
        kMeaning);
  }
  return {};
}

/// Checks the values in the file that describe its points; older files do not contain them.
Status check_stated(const YamlCursor& root, const Route& route,
                    const std::vector<std::array<double, kColumns>>& rows) {
  if (const auto stated = root.find("point_count")) {
    const auto count = stated->integer(0, 10'000'000);
    if (!count) return tl::unexpected(count.error());
    if (static_cast<std::size_t>(*count) != route.points.size())
      return stated->fail_here(
          ErrorCode::InvalidArgument,
          fmt::format("the file declares {} points but contains {}", *count, route.points.size()), kMend);
  }
  if (const auto stated = root.find("closing_gap_m")) {
    const auto gap = stated->number();
    if (!gap) return tl::unexpected(gap.error());
    if (!(std::abs(*gap - closing_gap_m(route)) < 1e-3))
      return stated->fail_here(
          ErrorCode::InvalidArgument,
          fmt::format("the file declares {:.3f} m from the last point to the first, but they are "
                      "{:.3f} m apart",
                      *gap, closing_gap_m(route)),
          kMend);
  }
  if (const auto stated = root.find("points_checksum")) {
    const auto sum = stated->text();
    if (!sum) return tl::unexpected(sum.error());
    if (*sum != checksum(rows))
      return stated->fail_here(ErrorCode::InvalidArgument,
                               "the checksum of the points does not match the file", kMend);
  }
  return {};
}

Status read_map_tag(const YamlCursor& entry, Route& route) {
  if (Status status = entry.check_keys({"tag", "x_m", "y_m"}); !status) return status;
  const Result<std::string> name = entry.read_at("tag", &YamlCursor::text);
  if (!name) return tl::unexpected(name.error());
  const Result<TagId> tag = parse_tag_id(*name);
  if (!tag) return entry.fail_here(tag.error().code, tag.error().message, tag.error().hint);
  const Result<double> x_m = entry.read_at("x_m", &YamlCursor::number);
  if (!x_m) return tl::unexpected(x_m.error());
  const Result<double> y_m = entry.read_at("y_m", &YamlCursor::number);
  if (!y_m) return tl::unexpected(y_m.error());
  route.map_tags.push_back({*tag, *x_m, *y_m});
  return {};
}

Status read_notes(const YamlCursor& root, Route& route) {
  if (const auto longest = root.find("longest_without_tags_m")) {
    const Result<double> metres = longest->number();
    if (!metres) return tl::unexpected(metres.error());
    if (!(*metres >= 0))
      return longest->fail_here(ErrorCode::InvalidArgument, "a length must not be negative");
    route.longest_without_tags_m = *metres;
  }
  const auto tags = root.find("map_tags");
  if (!tags) return {};
  for (const YamlCursor& entry : tags->children()) {
    if (Status status = read_map_tag(entry, route); !status) return status;
  }
  return {};
}

Status read_route_point(const YamlCursor& entry, Route& route,
                        std::vector<std::array<double, kColumns>>& rows) {
  const auto row = entry.exactly_numbers(kColumns);
  if (!row)
    return entry.fail_here(row.error().code, row.error().message,
                           "A point is [arc_length_m, x_m, y_m, yaw_rad, curvature_1_m, speed_m_s].");
  if (Status status = internal::check_proportion(entry, *row); !status) return status;
  const std::vector<double>& n = *row;
  std::ranges::copy(n, rows.emplace_back().begin());
  if (!route.points.empty() && n[0] <= route.points.back().arc_length_m)
    return entry.fail_here(ErrorCode::InvalidArgument, "the arc length does not increase");
  if (!(std::abs(n[5]) > 0)) return entry.fail_here(ErrorCode::InvalidArgument, "the speed must not be 0");
  route.points.push_back(
      {.map_T_base = SE2(n[1], n[2], n[3]), .arc_length_m = n[0], .curvature_1_m = n[4], .speed_m_s = n[5]});
  return {};
}

Status check_route_format(const YamlCursor& root) {
  const Result<std::string> format = root.read_at("format", &YamlCursor::text);
  if (!format)
    return root.fail_here(
        ErrorCode::Unreadable, "not a Waymark route",
        fmt::format("A route begins with `format: {}`; write one with `waymark map`.", kRouteFormat));
  if (*format != kRouteFormat)
    return root.at("format")->fail_here(ErrorCode::Unsupported,
                                        fmt::format("unsupported route format '{}'", *format),
                                        fmt::format("Known: {}.", kRouteFormat));
  return root.check_keys({"format", "closed", "length_m", "point_count", "closing_gap_m", "points_checksum",
                          "longest_without_tags_m", "map_tags", "stations", "points"});
}

Status read_station(const YamlCursor& entry, Route& route) {
  if (Status status = entry.check_keys({"name", "arc_length_m", "pause_s"}); !status) return status;
  const Result<std::string> name = entry.read_at("name", &YamlCursor::text);
  if (!name) return tl::unexpected(name.error());
  const Result<double> arc_length_m = entry.read_at("arc_length_m", &YamlCursor::number);
  if (!arc_length_m) return tl::unexpected(arc_length_m.error());
  const Result<double> pause_s = entry.read_at("pause_s", &YamlCursor::number);
  if (!pause_s) return tl::unexpected(pause_s.error());
  const Station station{.name = *name, .arc_length_m = *arc_length_m, .pause_s = *pause_s};
  if (Status status = check_station(route, station); !status)
    return entry.fail_here(status.error().code, status.error().message, status.error().hint);
  if (!route.stations.empty() && station.arc_length_m <= route.stations.back().arc_length_m)
    return entry.fail_here(ErrorCode::InvalidArgument, "the arc length of stations does not increase");
  route.stations.push_back(station);
  return {};
}

Status read_stations(const YamlCursor& root, Route& route) {
  const auto stations = root.find("stations");
  if (!stations) return {};
  if (!stations->is_sequence())
    return stations->fail_here(ErrorCode::InvalidArgument, "stations must be a list",
                               "For example - {name: shelf, arc_length_m: 3.2, pause_s: 5}.");
  for (const YamlCursor& entry : stations->children()) {
    if (Status status = read_station(entry, route); !status) return status;
  }
  return {};
}

}  // namespace

Result<Route> parse_route(std::string_view text, const std::string& source) {
  const Result<YamlNode> tree = parse_yaml(text, source, kRouteLimits);
  if (!tree) return tl::unexpected(tree.error());
  const YamlCursor root(*tree, source);
  if (Status status = check_route_format(root); !status) return tl::unexpected(status.error());
  Route route;
  const Result<bool> closed = root.read_at("closed", &YamlCursor::boolean);
  if (!closed) return tl::unexpected(closed.error());
  route.closed = *closed;
  const Result<double> length = root.read_at("length_m", &YamlCursor::number);
  if (!length) return tl::unexpected(length.error());
  if (Status status = internal::check_proportion(*root.at("length_m"), {&*length, 1}); !status)
    return tl::unexpected(status.error());
  route.length_m = *length;
  const Result<YamlCursor> points = root.at("points");
  if (!points) return tl::unexpected(points.error());
  std::vector<std::array<double, kColumns>> rows;
  for (const YamlCursor& entry : points->children()) {
    if (Status status = read_route_point(entry, route, rows); !status) return tl::unexpected(status.error());
  }
  if (route.points.size() < 2)
    return points->fail_here(
        ErrorCode::InvalidArgument,
        fmt::format("a route needs at least two points, but has {}", route.points.size()),
        "Map the lap again with `waymark map`.");
  Status whole = check_stated(root, route, rows);
  const double last = route.points.back().arc_length_m;
  if (route.closed ? !(route.length_m > last) : std::abs(route.length_m - last) > 1e-6)
    return root.at("length_m")
        ->fail_here(ErrorCode::InvalidArgument,
                    fmt::format("a length of {} m does not fit a last point at {} m", route.length_m, last),
                    kMend);
  if (whole) whole = check_spacing(*points, route);
  if (whole) whole = check_directions(*points, route);
  if (whole) whole = read_notes(root, route);
  if (!whole) return tl::unexpected(whole.error());
  if (Status status = read_stations(root, route); !status) return tl::unexpected(status.error());
  return route;
}

Route with_map(Route route, const TagMap& map) {
  constexpr std::size_t kMaxTags = 12;
  const std::size_t step = std::max<std::size_t>(1, (map.tags.size() + kMaxTags - 1) / kMaxTags);
  route.map_tags.clear();
  std::size_t i = 0;
  for (const auto& [id, tag] : map.tags) {
    const Eigen::Vector3d& map_p = tag.map_T_tag.translation();
    if (i++ % step == 0) route.map_tags.push_back({id, map_p.x(), map_p.y()});
  }
  return route;
}

Status check_map(const Route& route, const TagMap& map, const std::string& source) {
  constexpr double kSame_m = 0.25;
  std::size_t same = 0;
  for (const RouteTag& noted : route.map_tags) {
    const MappedTag* const tag = map.find(noted.tag);
    if (tag == nullptr) continue;
    const Eigen::Vector3d& map_p = tag->map_T_tag.translation();
    if (std::hypot(map_p.x() - noted.x_m, map_p.y() - noted.y_m) <= kSame_m) ++same;
  }
  if (2 * same >= route.map_tags.size()) return {};
  return fail(
      ErrorCode::InvalidArgument,
      fmt::format("this route belongs to another map: {} of the {} stored tags are where this map has "
                  "them",
                  same, route.map_tags.size()),
      {.source = source, .key = "map_tags"},
      "Put the map.yaml that it was made with next to it, or map its lap again with `waymark map`.");
}

Status check_station(const Route& route, const Station& station) {
  constexpr double kLongestPause_s = 86400;
  const auto wrong = [&](std::string message, std::string hint = {}) {
    return fail(ErrorCode::InvalidArgument, std::move(message), {.key = "stations"}, std::move(hint));
  };
  if (station.name.empty()) return wrong("a station without a name");
  if (std::ranges::any_of(station.name, [](unsigned char letter) { return letter < ' ' || letter == 0x7F; }))
    return wrong("the name of a station contains a line break or another control character",
                 "Give it a single-line name.");
  for (const Station& other : route.stations) {
    if (other.name == station.name) return wrong(fmt::format("duplicate station '{}'", station.name));
  }
  if (!(station.arc_length_m >= 0 && station.arc_length_m <= route.length_m))
    return wrong(fmt::format("'{}' at {:g} m is not on a route of {:.2f} m", station.name,
                             station.arc_length_m, route.length_m));
  if (!(station.pause_s >= 0 && station.pause_s <= kLongestPause_s))
    return wrong(fmt::format("invalid pause of {:g} s at '{}'", station.pause_s, station.name),
                 "Give 0 to 86400 s (a day).");
  return {};
}

Result<Route> read_route(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, kRouteLimits.bytes);
  if (!text) return tl::unexpected(text.error());
  return parse_route(*text, path.string());
}

std::string to_yaml(const Route& route) {
  std::string text = fmt::format(
      "# A route by Waymark, in the frame map. A closed route continues from its last point to its first.\n"
      "format: {}\nclosed: {}\nlength_m: {}\n",
      kRouteFormat, route.closed ? "true" : "false", yaml_number(route.length_m));
  if (!route.points.empty())
    text += fmt::format("point_count: {}\nclosing_gap_m: {}\npoints_checksum: \"{}\"\n", route.points.size(),
                        yaml_number(closing_gap_m(route)), checksum(rows_of(route)));
  if (route.longest_without_tags_m)
    text += fmt::format("longest_without_tags_m: {}\n", yaml_number(*route.longest_without_tags_m));
  if (!route.map_tags.empty()) text += "# Tags by which the map of this route is recognised.\nmap_tags:\n";
  for (const RouteTag& seen : route.map_tags)
    text += fmt::format("  - {{tag: \"{}\", x_m: {}, y_m: {}}}\n", to_string(seen.tag), yaml_number(seen.x_m),
                        yaml_number(seen.y_m));
  if (!route.stations.empty())
    text += "# The robot stops here for pause_s and then continues by itself.\nstations:\n";
  for (const Station& station : route.stations)
    text += fmt::format("  - {{name: {}, arc_length_m: {}, pause_s: {}}}\n", yaml_text(station.name),
                        yaml_number(station.arc_length_m), yaml_number(station.pause_s));
  text += "# [arc_length_m, x_m, y_m, yaw_rad, curvature_1_m, speed_m_s]\npoints:\n";
  for (const RoutePoint& point : route.points) text += line_of(point);
  return text;
}

Status write_route(const std::filesystem::path& path, const Route& route) {
  bool finite = std::isfinite(route.length_m);
  for (const RoutePoint& point : route.points) {
    for (const double number : row_of(point)) finite = finite && std::isfinite(number);
  }
  if (!finite)
    return fail(ErrorCode::InvalidArgument, "non-finite number in the route; not written",
                {.source = path.string()});
  return write_text_file(path, to_yaml(route));
}

}  // namespace waymark
