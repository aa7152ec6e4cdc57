#include "waymark/config/route_file.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>

#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_numbers.hpp"
#include "waymark/config/yaml_write.hpp"

namespace waymark {
namespace {

constexpr YamlLimits kRouteLimits{.bytes = std::size_t{1} << 26U, .nodes = 4'000'000, .depth = 16};
constexpr const char* kFormat = "waymark-route-1";
constexpr std::size_t kColumns = 6;

std::array<double, kColumns> row_of(const RoutePoint& point) {
  return {point.arc_length_m,     point.map_T_base.x(), point.map_T_base.y(),
          point.map_T_base.yaw(), point.curvature_1_m,  point.speed_m_s};
}

Status read_point(const YamlCursor& entry, Route& route) {
  const auto row = entry.exactly_numbers(kColumns);
  if (!row)
    return entry.fail_here(row.error().code, row.error().message,
                           "A point is [arc_length_m, x_m, y_m, yaw_rad, curvature_1_m, speed_m_s].");
  if (Status status = internal::check_proportion(entry, *row); !status) return status;
  const std::vector<double>& n = *row;
  if (!route.points.empty() && n[0] <= route.points.back().arc_length_m)
    return entry.fail_here(ErrorCode::InvalidArgument, "the arc length does not grow");
  if (!(std::abs(n[5]) > 0)) return entry.fail_here(ErrorCode::InvalidArgument, "the speed must not be 0");
  route.points.push_back(
      {.map_T_base = SE2(n[1], n[2], n[3]), .arc_length_m = n[0], .curvature_1_m = n[4], .speed_m_s = n[5]});
  return {};
}

Status check_format(const YamlCursor& root) {
  const Result<std::string> format = root.read_at("format", &YamlCursor::text);
  if (!format)
    return root.fail_here(ErrorCode::Unreadable, "not a route of Waymark",
                          fmt::format("It begins with `format: {}`; `waymark map` writes one.", kFormat));
  if (*format != kFormat)
    return root.at("format")->fail_here(ErrorCode::Unsupported,
                                        fmt::format("'{}' is not a format of routes known here", *format),
                                        fmt::format("Known: {}.", kFormat));
  return root.check_keys({"format", "closed", "length_m", "stations", "points"});
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
    return entry.fail_here(ErrorCode::InvalidArgument, "the arc length of stations does not grow");
  route.stations.push_back(station);
  return {};
}

Status read_stations(const YamlCursor& root, Route& route) {
  const auto stations = root.find("stations");
  if (!stations) return {};
  if (!stations->is_sequence())
    return stations->fail_here(ErrorCode::InvalidArgument, "stations are a list",
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
  if (Status status = check_format(root); !status) return tl::unexpected(status.error());
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
  for (const YamlCursor& entry : points->children()) {
    if (Status status = read_point(entry, route); !status) return tl::unexpected(status.error());
  }
  if (route.points.size() < 2)
    return points->fail_here(ErrorCode::InvalidArgument, "a route needs two points or more");
  const double last = route.points.back().arc_length_m;
  if (route.closed ? !(route.length_m > last) : std::abs(route.length_m - last) > 1e-6)
    return root.at("length_m")
        ->fail_here(ErrorCode::InvalidArgument,
                    fmt::format("a length of {} m does not fit a last point at {} m", route.length_m, last));
  if (Status status = read_stations(root, route); !status) return tl::unexpected(status.error());
  return route;
}

Status check_station(const Route& route, const Station& station) {
  constexpr double kLongestPause_s = 86400;
  const auto wrong = [&](std::string message, std::string hint = {}) {
    return fail(ErrorCode::InvalidArgument, std::move(message), {.key = "stations"}, std::move(hint));
  };
  if (station.name.empty()) return wrong("a station without a name");
  for (const Station& other : route.stations) {
    if (other.name == station.name) return wrong(fmt::format("two stations are called '{}'", station.name));
  }
  if (!(station.arc_length_m >= 0 && station.arc_length_m <= route.length_m))
    return wrong(fmt::format("'{}' at {:g} m is not on a route of {:.2f} m", station.name,
                             station.arc_length_m, route.length_m));
  if (!(station.pause_s >= 0 && station.pause_s <= kLongestPause_s))
    return wrong(fmt::format("a pause of {:g} s at '{}'", station.pause_s, station.name),
                 "From 0 to 86400 s, a day.");
  return {};
}

Result<Route> read_route(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, kRouteLimits.bytes);
  if (!text) return tl::unexpected(text.error());
  return parse_route(*text, path.string());
}

std::string to_yaml(const Route& route) {
  std::string text = fmt::format(
      "# A route by Waymark, in the frame map. A closed one goes on from its last point to its first.\n"
      "format: {}\nclosed: {}\nlength_m: {}\n",
      kFormat, route.closed ? "true" : "false", yaml_number(route.length_m));
  if (!route.stations.empty())
    text += "# Here the robot stands so long and then goes on by itself.\nstations:\n";
  for (const Station& station : route.stations)
    text += fmt::format("  - {{name: {}, arc_length_m: {}, pause_s: {}}}\n", yaml_text(station.name),
                        yaml_number(station.arc_length_m), yaml_number(station.pause_s));
  text += "# [arc_length_m, x_m, y_m, yaw_rad, curvature_1_m, speed_m_s]\npoints:\n";
  for (const RoutePoint& point : route.points) text += "  - " + yaml_list(row_of(point)) + "\n";
  return text;
}

Status write_route(const std::filesystem::path& path, const Route& route) {
  bool finite = std::isfinite(route.length_m);
  for (const RoutePoint& point : route.points) {
    for (const double number : row_of(point)) finite = finite && std::isfinite(number);
  }
  if (!finite)
    return fail(ErrorCode::InvalidArgument, "a number of the route is not finite: not written",
                {.source = path.string()});
  return write_text_file(path, to_yaml(route));
}

}  // namespace waymark
