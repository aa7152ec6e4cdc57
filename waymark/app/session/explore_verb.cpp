#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/app/session/explore_world.hpp"

namespace waymark::cli {
namespace {

struct ExploreArgs {
  explicit ExploreArgs(CLI::App& app)
      : settings(app),
        setup(app, "academy-house"),
        images(settings, Reach::SettingsOnly),
        explore(settings, "explore", "Wandering"),
        filter(settings, "filter", "Localisation") {
    add_fields(app, job);
    app.get_option("--output")->transform(recording_name());
    app.add_flag("--json", json, "Print one JSON object instead of text");
  }

  Settings settings;
  SetupFlags setup;
  ImageFlags images;
  OptionFlags<ExploreOptions> explore;
  OptionFlags<RiekfOptions> filter;
  ExploreJob job{};
  bool json = false;
};

ExitCode explore(const ExploreArgs& args, Console& console) {
  ExploreJob job = args.job;
  Status status = refuse(args.filter, kNoDelay, "Omit this option.", "lag_s");
  if (status) status = args.explore.apply(job.explore);
  if (status) status = args.filter.apply(job.filter);
  if (!status) return fail_usage(status.error(), console);
  Result<RobotSetup> setup = args.images.apply(args.setup.make());
  if (!setup) return fail_usage(setup.error(), console);
  const Result<ExploreReport> report = explore_world(std::move(*setup), job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report));
  if (report->interrupted) {
    console.note("stopped: the robot is stationary");
    return ExitCode::Interrupted;
  }
  if (!report->halt_reason.empty()) console.note("the robot is stopped: " + report->halt_reason);
  return report->collisions == 0 && report->halt_reason.empty() ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb explore_verb() {
  return {
      .name = "explore",
      .sentence = "Drive at random through a world while localising the robot",
      .help =
          R"(The robot drives forward with a random heading, turns by a random angle if its lidar detects an obstacle
nearby, and is localised with the map tags. This is the exercise "Marker Based Visual Loc" of JdeRobot's Robotics
Academy. Errors and collisions are measured against the ground truth of the simulator. A robot without a lidar
gets one for this drive.
Exit code: 0 no collision, 1 a collision, a stopped robot or an unusable file, 2 wrong usage, 130 stopped by
Ctrl-C.

Examples:
  waymark explore --world academy-house --minutes 3
  waymark explore --world academy-house --robot-file turtlebot3-waffle --seed 2 --minutes 60 --json
)",
      .prepare = prepared(explore),
      .report = report_of<ExploreReport>};
}

}  // namespace waymark::cli
