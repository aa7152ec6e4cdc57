#include "waymark/app/replay/edit_routes.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <system_error>

#include <fmt/format.h>

#include "waymark/app/common/route_files.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/replay/route_progress.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// The arc length specified by at_m or at_tag.
Result<double> place_of(const RoutesJob& job, const Route& route) {
  if (job.at_tag.empty()) return job.at_m.value_or(0);
  const Result<MapFile> map = read_map(fs::path(job.folder) / "map.yaml");
  if (!map) return tl::unexpected(map.error());
  std::vector<std::string> names;
  for (const auto& [tag, mapped] : map->tags.tags) {
    names.push_back(to_string(tag));
    if (job.at_tag != names.back() && job.at_tag != std::to_string(tag.number)) continue;
    const Eigen::Vector2d there = mapped.map_T_tag.translation().head<2>();
    const auto nearest = std::ranges::min_element(route.points, {}, [&](const RoutePoint& point) {
      return (point.map_T_base.translation() - there).squaredNorm();
    });
    return nearest->arc_length_m;
  }
  return fail(ErrorCode::NotFound, fmt::format("{} is not in the map", job.at_tag), {.key = "at_tag"},
              suggestion(job.at_tag, names));
}

Status remove_station(const std::string& name, Route& route) {
  std::vector<std::string> names;
  names.reserve(route.stations.size());
  for (const Station& station : route.stations) names.push_back(station.name);
  if (std::erase_if(route.stations, [&](const Station& station) { return station.name == name; }) > 0)
    return {};
  return fail(ErrorCode::NotFound, fmt::format("the route has no station '{}'", name),
              {.key = "remove_station"}, names.empty() ? "It has no stations." : suggestion(name, names));
}

Status add_station(const RoutesJob& job, Route& route) {
  const Result<double> arc_length_m = place_of(job, route);
  if (!arc_length_m) return tl::unexpected(arc_length_m.error());
  Station station{.name = job.station, .arc_length_m = *arc_length_m, .pause_s = job.pause_s.value_or(5)};
  // Replaces an existing station with this name; its dwell time is kept unless a new one is set.
  const auto before = std::ranges::find(route.stations, job.station, &Station::name);
  if (before != route.stations.end() && !job.pause_s) station.pause_s = before->pause_s;
  std::erase_if(route.stations, [&](const Station& other) { return other.name == station.name; });
  if (Status status = check_station(route, station); !status) {
    status.error().place.key = "station";
    return status;
  }
  const auto after =
      std::ranges::upper_bound(route.stations, station.arc_length_m, {}, &Station::arc_length_m);
  if (after != route.stations.begin() && std::prev(after)->arc_length_m == station.arc_length_m)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the station '{}' is already at this position", std::prev(after)->name),
                {.key = "station"});
  route.stations.insert(after, std::move(station));
  return {};
}

Status change(const RoutesJob& job, Route& route) {
  if (!job.remove.empty()) {
    if (Status status = remove_station(job.remove, route); !status) return status;
  }
  return job.station.empty() ? Status() : add_station(job, route);
}

Status check_job(const RoutesJob& job) {
  if (job.route && job.route->empty()) return check_route_name(*job.route, "route");
  const bool placed = job.at_m || !job.at_tag.empty();
  if (!job.station.empty() && !placed)
    return fail(ErrorCode::InvalidArgument, "a station needs a position", {.key = "station"},
                "Add `at_m`, metres along the route, or `at_tag`.");
  if (job.station.empty() && placed)
    return fail(ErrorCode::InvalidArgument, "a position needs a station",
                {.key = job.at_tag.empty() ? "at_m" : "at_tag"}, "Name the station with `station`.");
  if (job.station.empty() && job.pause_s)
    return fail(ErrorCode::InvalidArgument, "a dwell time needs a station", {.key = "pause_s"},
                "Add `station`, and its position with `at_m` or `at_tag`.");
  if (!job.at_tag.empty() && job.at_m)
    return fail(ErrorCode::InvalidArgument, "two positions for one station", {.key = "at_tag"},
                "Give either `at_m` or `at_tag`.");
  return {};
}

/// Reads a route, and writes the change if requested.
Result<NamedRoutes> one_route(const RoutesJob& job) {
  const fs::path folder = job.folder;
  const std::string name = job.route.value_or("");
  if (Status status = check_route_exists(folder, name); !status) return tl::unexpected(status.error());
  const fs::path file = folder / route_file_name(name);
  Result<Route> route = read_route(file);
  if (!route) return tl::unexpected(route.error());
  if (!job.station.empty() || !job.remove.empty()) {
    Status status = change(job, *route);
    if (status) status = write_route(file, *route);
    if (!status) return tl::unexpected(status.error());
  }
  return NamedRoutes{{name, std::move(*route)}};
}

Result<NamedRoutes> all_routes(const fs::path& folder) {
  std::vector<std::string> names = route_names(folder);
  std::error_code ignored;
  if (fs::exists(folder / route_file_name(""), ignored)) names.insert(names.begin(), "");
  if (names.empty()) return tl::unexpected(check_route_exists(folder, "").error());
  NamedRoutes routes;
  for (const std::string& name : names) {
    Result<Route> route = read_route(folder / route_file_name(name));
    if (!route) return tl::unexpected(route.error());
    routes.push_back({name, std::move(*route)});
  }
  return routes;
}

}  // namespace

Result<NamedRoutes> edit_routes(const RoutesJob& job) {
  Status status = check_job(job);
  if (status) status = check_map_folder(job.folder);
  if (!status) return tl::unexpected(status.error());
  const bool one = job.route || !job.station.empty() || !job.remove.empty();
  return one ? one_route(job) : all_routes(job.folder);
}

ReportFields fields(const Station& station) {
  return {{"name", "Name of the station", station.name},
          {"arc_length_m", "Position along the route", station.arc_length_m},
          {"pause_s", "Dwell time", station.pause_s}};
}

ReportFields fields(const NamedRoute& named) {
  const Route& route = named.route;
  const bool reverses =
      std::ranges::any_of(route.points, [](const RoutePoint& p) { return p.speed_m_s < 0; });
  return {{"route", "Name of the route; empty: the taught route", named.name},
          {"file", "File in the folder of the map", route_file_name(named.name)},
          {"length_m", "Length of the route", route.length_m},
          {"closed", "Whether the route is closed", route.closed},
          {"reverses", "Whether the route changes direction", reverses},
          {"stations", "Stations in order", route.stations}};
}

std::string to_text(const NamedRoute& named) {
  const auto& [name, route] = named;
  std::string text = fmt::format("{:<20} {:>8.2f} m, {}\n", name.empty() ? "(taught)" : name, route.length_m,
                                 route.closed ? "closed" : "open");
  for (const Station& station : route.stations)
    text += fmt::format("  {:<18} {:>8.2f} m, dwell time {:g} s\n", station.name, station.arc_length_m,
                        station.pause_s);
  return text;
}

}  // namespace waymark
