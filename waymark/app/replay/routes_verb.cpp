#include "waymark/app/cli/parts.hpp"
#include "waymark/app/replay/edit_routes.hpp"

namespace waymark::cli {
namespace {

struct RoutesArgs : JobArgs<RoutesJob> {
  explicit RoutesArgs(CLI::App& app)
      : JobArgs(app, "Print one JSON object per route instead of text"), given(given_on(app)) {}

  GivenFields given;
};

ExitCode routes(const RoutesArgs& args, Console& console) {
  RoutesJob job = args.job;
  if (args.given("route") && !job.route) job.route = "";  // an empty name selects the route taught first
  const Result<NamedRoutes> found = edit_routes(job);
  if (!found) return fail_with(found.error(), console);
  for (const NamedRoute& named : *found) console.print(args.json ? json_line(fields(named)) : to_text(named));
  return ExitCode::Ok;
}

}  // namespace

Verb routes_verb() {
  return {
      .name = "routes",
      .sentence = "List the routes of a map, and edit the stations on them",
      .help =
          R"(The taught route is route.yaml. Routes with a name are route-NAME.yaml: laps added by `waymark map --extend MAP
--route-name NAME`, and routes of `waymark optimize`. `waymark replay MAP --route NAME` drives one of them.
At a station the robot stops for the dwell time and continues by itself, on a closed route in every lap.

Exit code: 0 done, 1 a file was unusable, 2 wrong usage.

Examples:
  waymark routes map
  waymark routes map --station shelf --at-m 4.5 --pause-s 10
  waymark routes map --route kitchen --station door --at-tag 7
  waymark routes map --remove-station shelf
)",
      .prepare = prepared(routes),
      .report = report_of<NamedRoute>};
}

}  // namespace waymark::cli
