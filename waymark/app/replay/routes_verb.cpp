#include "waymark/app/cli/parts.hpp"
#include "waymark/app/replay/edit_routes.hpp"

namespace waymark::cli {
namespace {

struct RoutesArgs : JobArgs<RoutesJob> {
  explicit RoutesArgs(CLI::App& app)
      : JobArgs(app, "One JSON object a route instead of words"), given(given_on(app)) {}

  GivenFlags given;
};

ExitCode routes(const RoutesArgs& args, Console& console) {
  RoutesJob job = args.job;
  if (args.given("route") && !job.route) job.route = "";  // an empty name: the taught one
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
      .prepare = prepared(routes),
      .report = report_of<NamedRoute>};
}

}  // namespace waymark::cli
