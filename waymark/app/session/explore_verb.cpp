#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/app/session/explore_world.hpp"

namespace waymark::cli {
namespace {

struct ExploreArgs {
  explicit ExploreArgs(CLI::App& app)
      : settings(app),
        setup(app, "academy-house"),
        pictures(settings, Reach::SettingsOnly),
        explore(settings, "explore", "Wandering"),
        filter(settings, "filter", "Localisation") {
    add_fields(app, job);
    app.get_option("--output")->transform(recording_name());
    app.add_flag("--json", json, "One JSON object instead of words");
  }

  Settings settings;
  SetupFlags setup;
  PictureFlags pictures;
  OptionFlags<ExploreOptions> explore;
  OptionFlags<RiekfOptions> filter;
  ExploreJob job{};
  bool json = false;
};

ExitCode explore(const ExploreArgs& args, Console& console) {
  ExploreJob job = args.job;
  Status status = refuse(args.filter, kNoDelay, "Leave it out.", "lag_s");
  if (status) status = args.explore.apply(job.explore);
  if (status) status = args.filter.apply(job.filter);
  if (!status) return fail_usage(status.error(), console);
  Result<RobotSetup> setup = args.pictures.apply(args.setup.make());
  if (!setup) return fail_usage(setup.error(), console);
  const Result<ExploreReport> report = explore_world(std::move(*setup), job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report));
  if (report->interrupted) {
    console.say("stopped: the robot stands");
    return ExitCode::Interrupted;
  }
  if (!report->stands.empty()) console.say("the robot stands: " + report->stands);
  return report->collisions == 0 && report->stands.empty() ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb explore_verb() {
  return {
      .name = "explore",
      .sentence = "Explore at random while the robot is localised",
      .help =
          R"(The robot drives forward with a heading that wanders at random, turns by a random angle where its lidar
sees something near, and localises itself by the tags of the map: the exercise "Marker Based Visual Loc" of
JdeRobot's Robotics Academy. What is reported of errors and collisions is by the truth of the simulator.
A robot without a lidar gets one for it.

Exit code: 0 nothing was met, 1 something was, or a file was unusable, 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark explore --world academy-house --minutes 3
  waymark explore --world academy-house --robot-file turtlebot3-waffle --seed 2 --minutes 60 --json
)",
      .prepare = prepared(explore),
      .report = report_of<ExploreReport>};
}

}  // namespace waymark::cli
