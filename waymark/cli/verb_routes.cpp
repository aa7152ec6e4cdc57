#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/base/suggest.hpp"
#include "waymark/cli/detections_json.hpp"
#include "waymark/cli/page_files.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/config/route_file.hpp"
#include "waymark/jobs/route_files.hpp"
#include "waymark/replay/route_progress.hpp"

namespace waymark::cli {
namespace {

namespace fs = std::filesystem;

struct RoutesArgs {
  std::string folder;
  std::string route;
  std::string station;
  std::string remove;
  std::string at_tag;
  const CLI::Option* named = nullptr;
  const CLI::Option* at_m = nullptr;
  const CLI::Option* pause = nullptr;
  double arc_length_m = 0;
  double pause_s = 5;
  bool json = false;
};

nlohmann::ordered_json json_of(const std::string& name, const Route& route) {
  auto stations = nlohmann::ordered_json::array();
  for (const Station& station : route.stations)
    stations.push_back(
        {{"name", station.name}, {"arc_length_m", station.arc_length_m}, {"pause_s", station.pause_s}});
  const bool reverses =
      std::ranges::any_of(route.points, [](const RoutePoint& p) { return p.speed_m_s < 0; });
  return {{"route", name},          {"file", route_file_name(name)}, {"length_m", route.length_m},
          {"closed", route.closed}, {"reverses", reverses},          {"stations", std::move(stations)}};
}

std::string line_of(const std::string& name, const Route& route) {
  std::string text = fmt::format("{:<20} {:>8.2f} m, {}\n", name.empty() ? "(taught)" : name, route.length_m,
                                 route.closed ? "closed" : "open");
  for (const Station& station : route.stations)
    text += fmt::format("  {:<18} {:>8.2f} m, stands for {:g} s\n", station.name, station.arc_length_m,
                        station.pause_s);
  return text;
}

/// Where --at-m or --at-tag say.
Result<double> place_of(const RoutesArgs& args, const Route& route) {
  if (args.at_tag.empty()) return args.arc_length_m;
  const Result<MapFile> map = read_map(fs::path(args.folder) / "map.yaml");
  if (!map) return tl::unexpected(map.error());
  std::vector<std::string> names;
  for (const auto& [tag, mapped] : map->tags.tags) {
    names.push_back(to_string(tag));
    if (args.at_tag != names.back() && args.at_tag != std::to_string(tag.number)) continue;
    const Eigen::Vector2d there = mapped.map_T_tag.translation().head<2>();
    const auto nearest = std::ranges::min_element(route.points, {}, [&](const RoutePoint& point) {
      return (point.map_T_base.translation() - there).squaredNorm();
    });
    return nearest->arc_length_m;
  }
  return fail(ErrorCode::NotFound, fmt::format("{} is not in the map", args.at_tag), {.key = "--at-tag"},
              suggestion(args.at_tag, names));
}

Status remove_station(const std::string& name, Route& route) {
  std::vector<std::string> names;
  names.reserve(route.stations.size());
  for (const Station& station : route.stations) names.push_back(station.name);
  if (std::erase_if(route.stations, [&](const Station& station) { return station.name == name; }) > 0)
    return {};
  return fail(ErrorCode::NotFound, fmt::format("the route has no station '{}'", name),
              {.key = "--remove-station"}, suggestion(name, names));
}

Status add_station(const RoutesArgs& args, Route& route) {
  const Result<double> arc_length_m = place_of(args, route);
  if (!arc_length_m) return tl::unexpected(arc_length_m.error());
  Station station{.name = args.station, .arc_length_m = *arc_length_m, .pause_s = args.pause_s};
  // One of this name is put there instead, and keeps what is not said again.
  const auto before = std::ranges::find(route.stations, args.station, &Station::name);
  if (before != route.stations.end() && args.pause->count() == 0) station.pause_s = before->pause_s;
  std::erase_if(route.stations, [&](const Station& other) { return other.name == station.name; });
  if (Status status = check_station(route, station); !status) return status;
  const auto after =
      std::ranges::upper_bound(route.stations, station.arc_length_m, {}, &Station::arc_length_m);
  if (after != route.stations.begin() && std::prev(after)->arc_length_m == station.arc_length_m)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("'{}' is at this place already", std::prev(after)->name), {.key = "--station"});
  route.stations.insert(after, std::move(station));
  return {};
}

Status change(const RoutesArgs& args, Route& route) {
  if (!args.remove.empty()) {
    if (Status status = remove_station(args.remove, route); !status) return status;
  }
  return args.station.empty() ? Status() : add_station(args, route);
}

Status check_flags(const RoutesArgs& args) {
  if (args.named->count() > 0 && args.route.empty()) return check_route_name(args.route, "--route");
  const bool placed = args.at_m->count() > 0 || !args.at_tag.empty();
  if (!args.station.empty() && !placed)
    return fail(ErrorCode::InvalidArgument, "where is the station?", {.key = "--station"},
                "Give --at-m, metres along the route, or --at-tag.");
  if (args.station.empty() && placed)
    return fail(ErrorCode::InvalidArgument, "a place without a station",
                {.key = args.at_tag.empty() ? "--at-m" : "--at-tag"}, "Name it with --station.");
  if (args.station.empty() && args.pause->count() > 0)
    return fail(ErrorCode::InvalidArgument, "a pause without a station", {.key = "--pause-s"},
                "Name it with --station, and where it is with --at-m or --at-tag.");
  if (!args.at_tag.empty() && args.at_m->count() > 0)
    return fail(ErrorCode::InvalidArgument, "two places for one station", {.key = "--at-tag"},
                "Give --at-m or --at-tag.");
  return {};
}

/// One route, changed where that is asked for.
Status one_route(const RoutesArgs& args, Console& console) {
  const fs::path folder = args.folder;
  if (Status status = check_route_exists(folder, args.route); !status) return status;
  const fs::path file = folder / route_file_name(args.route);
  Result<Route> route = read_route(file);
  if (!route) return tl::unexpected(route.error());
  if (!args.station.empty() || !args.remove.empty()) {
    Status status = change(args, *route);
    if (status) status = write_route(file, *route);
    if (!status) return status;
  }
  console.print(args.json ? json_line(json_of(args.route, *route)) : line_of(args.route, *route));
  return {};
}

Status all_routes(const RoutesArgs& args, Console& console) {
  const fs::path folder = args.folder;
  std::vector<std::string> names = route_names(folder);
  std::error_code ignored;
  if (fs::exists(folder / route_file_name(""), ignored)) names.insert(names.begin(), "");
  if (names.empty()) return check_route_exists(folder, "");
  for (const std::string& name : names) {
    const Result<Route> route = read_route(folder / route_file_name(name));
    if (!route) return tl::unexpected(route.error());
    console.print(args.json ? json_line(json_of(name, *route)) : line_of(name, *route));
  }
  return {};
}

ExitCode routes(const RoutesArgs& args, Console& console) {
  Status status = check_flags(args);
  if (status) status = check_map_folder(args.folder);
  const bool one = !args.route.empty() || !args.station.empty() || !args.remove.empty();
  if (status) status = one ? one_route(args, console) : all_routes(args, console);
  if (status) return ExitCode::Ok;
  console.say(status.error());
  return exit_code_of(status.error());
}

Run prepare_routes(CLI::App& app) {
  const auto args = std::make_shared<RoutesArgs>();
  app.add_option("MAP", args->folder, "Folder that `waymark map` wrote")->required()->type_name("");
  args->named = app.add_option("--route", args->route,
                               "This route alone; unless given, stations are the taught route's")
                    ->type_name("NAME");
  app.add_option("--station", args->station,
                 "A place where the robot stands for a while: it is put on the route, or moved")
      ->type_name("NAME");
  args->at_m = app.add_option("--at-m", args->arc_length_m, "Where: metres along the route")
                   ->check(CLI::Range(0.0, 1e6))
                   ->type_name("FLOAT");
  app.add_option("--at-tag", args->at_tag, "Where: the place of the route nearest to this tag")
      ->type_name("TAG");
  args->pause = app.add_option("--pause-s", args->pause_s,
                               "How long it stands there; a station that is moved keeps what it had")
                    ->capture_default_str()
                    ->check(CLI::Range(0.0, 86400.0))
                    ->type_name("FLOAT");
  app.add_option("--remove-station", args->remove, "This station is one no more")->type_name("NAME");
  app.add_flag("--json", args->json, "One JSON object a route instead of words");
  return [args](Console& console) { return routes(*args, console); };
}

}  // namespace

Verb routes_verb() {
  return {
      .name = "routes",
      .sentence = "List the routes of a map, and say where the robot pauses on them",
      .help =
          R"(The taught route is route.yaml, those with a name are route-NAME.yaml: laps that `waymark map --extend MAP
--route-name NAME` added, and what `waymark optimize` made. `waymark replay MAP --route NAME` drives one.
At a station the robot stops, stands for the pause, and goes on by itself; on a closed route in every lap.

Exit code: 0 done, 1 a file was unusable, 2 wrong usage.

Examples:
  waymark routes map
  waymark routes map --station shelf --at-m 4.5 --pause-s 10
  waymark routes map --route kitchen --station door --at-tag 7
  waymark routes map --remove-station shelf
)",
      .prepare = prepare_routes,
      .verbs = {}};
}

}  // namespace waymark::cli
