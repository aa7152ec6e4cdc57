#include <memory>
#include <string>

#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/cli/warnings.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/world_from_recording.hpp"

namespace waymark::cli {
namespace {

struct FromRecordingArgs {
  WorldFromRecordingJob job{};
  bool json = false;
};

ExitCode make_world_from(const FromRecordingArgs& args, Console& console) {
  const auto report = world_from_recording(args.job, control_from(console));
  if (!report)
    return console.failed(report.error(), interrupted() ? ExitCode::Interrupted : ExitCode::SomeFailed);
  say_warnings(report->warnings, console);
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report, args.job.folder));
  return ExitCode::Ok;
}

Run prepare_from_recording(CLI::App& app) {
  const auto args = std::make_shared<FromRecordingArgs>();
  app.add_option("RECORDING", args->job.recording, "Recorded drive: anything that `waymark info` reads")
      ->required()
      ->type_name("");
  app.add_option("--map", args->job.map, "Folder that `waymark map` made of this recording")
      ->required()
      ->type_name("FOLDER");
  app.add_option("-o,--output", args->job.folder, "Folder to write, not there yet or empty")
      ->required()
      ->type_name("FOLDER");
  app.add_option(
         "--robot", args->job.robot,
         "Robot whose body and behaviour are the start, by name or .yaml file. Unless given: robot.yaml of "
         "the map")
      ->type_name("NAME");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return make_world_from(*args, console); };
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
"not told". Walls and furniture are not known. Afterwards `waymark report` sets a simulated drive beside the
real one.

Exit code: 0 written, 1 recording or map could not be read or do not belong together, 2 wrong usage.

Examples:
  waymark world from-recording lap.mcap --map map -o twin
  waymark teach --world twin/world.yaml --robot-file twin/robot.yaml -o sim.mcap
  waymark report lap.mcap sim.mcap
)",
      .prepare = prepare_from_recording,
      .verbs = {}};
}

}  // namespace waymark::cli
