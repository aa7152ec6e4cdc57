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
          R"(Measures the properties of a drive using its map. It writes world.yaml with tags and route from the map, and robot.yaml
with the properties of the robot. These are rates, latency, noise of corners, gyro and accelerometer, fraction of missed
tags, detection range, odometry errors, and the response to commands. If the recording contains images taken in motion,
camera.yaml contains exposure time and lens blur, for --config. Values that the recording does not determine are taken
from the robot file and listed as "not determined". Walls and furniture are unknown. `waymark report` then compares a
simulated drive with the real one.

Exit code: 0 the folder was written, 1 recording or map is unreadable, or they do not match, 2 wrong usage.

Examples:
  waymark world from-recording lap.mcap --map map -o twin
  waymark teach --world twin/world.yaml --robot-file twin/robot.yaml -o sim.mcap
  waymark report lap.mcap sim.mcap
)",
      .prepare = prepared(make_world_from),
      .report = report_of<WorldFromRecordingReport>};
}

}  // namespace waymark::cli
