#include "waymark/app/cli/parts.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/world/judge_world.hpp"
#include "waymark/config/share.hpp"

namespace waymark::cli {
namespace {

struct OrbitArgs {
  explicit OrbitArgs(CLI::App& app) : settings(app), options(settings, "orbit", kFirstGroup) {
    add_option(app, "WORLD", world, std::string(kWorldNames), kRequired);
    add_option(app, "-o,--output FILE", output, "Figure to draw of the result (.svg, .png or .pdf)");
    app.add_flag("--json", json, "One JSON object instead of words");
  }

  Settings settings;
  std::string world;
  std::string output;
  bool json = false;
  OptionFlags<OrbitOptions> options;
};

ExitCode go_round(const OrbitArgs& args, Console& console) {
  OrbitOptions options;
  Status status = args.options.apply(options);
  const Result<RobotSetup> setup = load_setup(args.world, {}, 1);
  if (status && !setup) status = tl::unexpected(setup.error());
  if (!status) return fail_usage(status.error(), console);
  const World& world = setup->simulated.world;
  const Result<OrbitReport> report = orbit(world, options);
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(WorldOrbit{world.name, *report})) : to_text(*report, world));
  if (!args.output.empty()) {
    if (status = write_orbit(args.output, world, *report); !status) {
      console.say(status.error());
      return ExitCode::SomeFailed;
    }
  }
  return report->closes() && report->continuous() && report->upright() ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb world_orbit_verb() {
  return {
      .name = "orbit",
      .sentence = "Validate frames and axes with a camera that goes round the tags",
      .help =
          R"(After Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot", section 3.1. A nominal
camera goes round all tags on a circle and looks at their middle. Without noise the camera through the
anchor (equation 3.1), every tag through the camera, and every way round must close; with noise on camera
and tags the composed frames may neither jump nor turn an axis over.

Exit code: 0 all of it holds, 1 it does not, or the file cannot be read, 2 wrong usage.

Examples:
  waymark world orbit circuit24
  waymark world orbit circuit24 -o orbit.svg --sigma-m 0.01 --sigma-deg 1
)",
      .prepare = prepared(go_round),
      .report = report_of<WorldOrbit>};
}

}  // namespace waymark::cli
