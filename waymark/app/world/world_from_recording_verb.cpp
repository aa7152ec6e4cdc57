#include "waymark/app/cli/parts.hpp"
#include "waymark/app/world/world_from_recording.hpp"

namespace waymark::cli {
namespace {

using FromRecordingArgs = JobArgs<WorldFromRecordingJob>;

ExitCode make_world_from(const FromRecordingArgs& args, Console& console) {
  const auto report = world_from_recording(args.job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.warn(report->warnings);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report, args.job.folder));
  return ExitCode::Ok;
}

}  // namespace

Verb world_from_recording_verb() {
  return {
      .name = "from-recording",
      .sentence = "Make a world and a robot with the statistics of a recorded drive",
      .help =
          R"(Measures a drive against the map that was made of it, and writes world.yaml (tags and route of the map), robot.yaml
(rates, latency, noise of corners, gyro and accelerometer, share of missed tags, detection range, errors of the
odometry, response to commands) and, where the recording holds pictures that move, camera.yaml (exposure and blur
of the lens, for --config). What the recording does not tell stays as the robot's file says, and is listed as
"not determined". Walls and furniture are not known. Afterwards `waymark report` sets a simulated drive beside the
real one.

Exit code: 0 written, 1 recording or map could not be read or do not belong together, 2 wrong usage.

Examples:
  waymark world from-recording lap.mcap --map map -o twin
  waymark teach --world twin/world.yaml --robot-file twin/robot.yaml -o sim.mcap
  waymark report lap.mcap sim.mcap
)",
      .prepare = prepared(make_world_from),
      .report = report_of<WorldFromRecordingReport>};
}

}  // namespace waymark::cli
