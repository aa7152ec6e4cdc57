#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/app/common/profile_table.hpp"
#include "waymark/app/world/simulate_like.hpp"

namespace waymark::cli {
namespace {

struct SimulateArgs {
  explicit SimulateArgs(CLI::App& app)
      : settings(app), setup(app, "circuit24"), images(settings, Reach::Flags) {
    add_fields(app, job);
    app.get_option("--output")->transform(recording_name());
    app.add_flag("--json", json, "Print one JSON object instead of text");
  }

  Settings settings;
  SetupFlags setup;
  ImageFlags images;
  SimulateLikeJob job{};
  bool json = false;
};

ExitCode simulate(const SimulateArgs& args, Console& console) {
  Result<RobotSetup> setup = args.images.apply(args.setup.make());
  if (!setup) return fail_usage(setup.error(), console);
  const Result<RecordingProfile> like = profile_of(args.job.like, silent(control_from(console)));
  if (!like) return fail_with(like.error(), console);
  setup->simulated.robot = options_like(*like, setup->simulated.robot);
  const Result<RecordingProfile> made = simulate_like(*setup, *like, args.job, control_from(console));
  if (!made) return fail_with(made.error(), console);
  const std::vector<ProfileRow> rows = profile_table(*like, *made);
  console.print(args.json ? json_line(fields(ProfileReport{args.job.output, rows})) : to_text(rows));
  return interrupted() ? ExitCode::Interrupted : ExitCode::Ok;
}

}  // namespace

Verb simulate_verb() {
  return {
      .name = "simulate",
      .sentence = "Simulate a recording with the rates, gaps, noise and speeds of a real one",
      .help =
          R"(Measures a recording: rates and gaps of each sensor, noise of corners, gyro and accelerometer, fraction of missed tags,
image latency, command delay, and robot speeds. It then simulates a robot with these properties on the line in a world,
for the same duration, and prints both side by side, measured in the same way. Properties that cannot be determined from
the recording are taken from the robot file. The simulated robot has one camera. If the recording has several, the one
with the most data is imitated. The simulated robot follows a line, so it never turns on the spot.

Exit code: 0 a recording was written, 1 a recording could not be read or written, 2 wrong usage.

Example:
  waymark simulate --like lap.mcap --world circuit24 -o like.mcap
)",
      .prepare = prepared(simulate),
      .report = report_of<ProfileReport>};
}

}  // namespace waymark::cli
