#include "waymark/app/cli/parts.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/world/judge_world.hpp"
#include "waymark/config/share.hpp"

namespace waymark::cli {
namespace {

struct OrbitArgs {
  explicit OrbitArgs(CLI::App& app) : settings(app), options(settings, "orbit", kFirstGroup) {
    add_option(app, "WORLD", world, std::string(kWorldNames), kRequired);
    add_option(app, "-o,--output FILE", output, "Figure of the result (.svg, .png or .pdf)");
    app.add_flag("--json", json, "Print one JSON object instead of text");
  }

  Settings settings;
  std::string world;
  std::string output;
  bool json = false;
  OptionFlags<OrbitOptions> options;
};

ExitCode validate_frames(const OrbitArgs& args, Console& console) {
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
      console.note(status.error());
      return ExitCode::SomeFailed;
    }
  }
  return report->closes() && report->continuous() && report->upright() ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb world_orbit_verb() {
  return {
      .name = "orbit",
      .sentence = "Validate frames and axes with a camera on a circle around the tags",
      .help =
          R"(After Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot", section 3.1. A nominal
camera moves around all tags on a circle and points at their centre. Without noise, the camera pose via the
anchor (equation 3.1), every tag pose via the camera, and every loop of transforms must close. With noise on
camera and tags, no composed frame may jump or invert an axis.

Exit code: 0 all checks pass, 1 a check fails, or the file cannot be read, 2 wrong usage.

Examples:
  waymark world orbit circuit24
  waymark world orbit circuit24 -o orbit.svg --sigma-m 0.01 --sigma-deg 1
)",
      .prepare = prepared(validate_frames),
      .report = report_of<WorldOrbit>};
}

}  // namespace waymark::cli
