#include <memory>
#include <string>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/failure.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/edit_routes.hpp"
#include "waymark/jobs/json_line.hpp"

namespace waymark::cli {
namespace {

struct RoutesArgs {
  RoutesJob job{};
  std::string route;
  const CLI::Option* named = nullptr;
  bool json = false;
};

ExitCode routes(const RoutesArgs& args, Console& console) {
  RoutesJob job = args.job;
  if (args.named->count() > 0) job.route = args.route;
  const Result<NamedRoutes> found = edit_routes(job);
  if (!found) return fail_with(found.error(), console);
  for (const auto& [name, route] : *found)
    console.print(args.json ? json_line(to_json(name, route)) : to_text(name, route));
  return ExitCode::Ok;
}

Run prepare_routes(CLI::App& app) {
  const auto args = std::make_shared<RoutesArgs>();
  app.add_option("MAP", args->job.folder, "Folder that `waymark map` wrote")->required()->type_name("");
  args->named = app.add_option("--route", args->route,
                               "Name of the route to list or edit. Unless given: the taught route for "
                               "stations, all routes for the list")
                    ->type_name("NAME");
  app.add_option("--station", args->job.station,
                 "Name of a station, a place where the robot stops for a while, to add or move")
      ->type_name("NAME");
  app.add_option("--at-m", args->job.at_m, "Position of the station along the route, in metres")
      ->check(CLI::Range(0.0, 1e6))
      ->type_name("FLOAT");
  app.add_option("--at-tag", args->job.at_tag,
                 "Tag whose nearest point of the route is the position of the station")
      ->type_name("TAG");
  app.add_option("--pause-s", args->job.pause_s,
                 "Duration of the stop at the station; a station that is moved keeps its duration")
      ->default_str("5")
      ->check(CLI::Range(0.0, 86400.0))
      ->type_name("FLOAT");
  app.add_option("--remove-station", args->job.remove, "Name of a station to remove")->type_name("NAME");
  app.add_flag("--json", args->json, "One JSON object a route instead of words");
  return [args](Console& console) { return routes(*args, console); };
}

}  // namespace

Verb routes_verb() {
  return {
      .name = "routes",
      .sentence = "List the routes of a map, and edit the stations on them",
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
