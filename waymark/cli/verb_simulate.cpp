#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/file_names.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/lap_file.hpp"
#include "waymark/cli/picture_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/evaluation/recording_profile.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/profile_table.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/simulation/path.hpp"

namespace waymark::cli {
namespace {

struct SimulateArgs {
  explicit SimulateArgs(CLI::App& app)
      : settings(app), setup(app, "circuit24"), pictures(app, settings, Reach::Flags) {}

  Settings settings;
  SetupFlags setup;
  PictureFlags pictures;
  std::string like;
  std::string output;
  bool json = false;
};

std::string to_text(const std::vector<ProfileRow>& rows) {
  const auto cell = [](const std::optional<double>& value) {
    return value ? fmt::format("{:.4g}", *value) : "-";
  };
  std::string text = fmt::format("{:<40}{:>12}{:>12}\n", "", "recording", "simulation");
  for (const ProfileRow& row : rows)
    text += fmt::format("{:<40}{:>12}{:>12}\n", row.words, cell(row.recording), cell(row.simulation));
  return text;
}

/// Steers along the world's line as fast as the recording did.
Result<LapEnd> drive_like(const SimulatedSetup& setup, const RecordingProfile& profile,
                          const LapListener& listener) {
  const auto path = sample_path(setup.world.path_m, setup.world.path_closed, 0.02);
  constexpr DriverOptions kDriver{.overlap_m = 1e6};  // as long as the recording
  ScriptedDriver driver(path, setup.world.path_closed, kDriver, Random(setup.robot.seed + 1000));
  const auto drive = [&](const SE2& map_T_base, Duration uptime, SensorTime) -> Result<DriverDecision> {
    const VelocityCommand steady = driver.drive(map_T_base, SensorTime(uptime));
    const auto index = static_cast<std::size_t>(to_seconds(uptime) * 10);
    if (driver.done() || index >= profile.speeds.size()) return DriverDecision{.done = true};
    const double speed = std::abs(profile.speeds[index].speed_m_s);
    const double curvature = steady.speed_m_s > 0 ? steady.yaw_rate_rad_s / steady.speed_m_s : 0;
    return DriverDecision{.command = {speed, speed * curvature}};
  };
  return drive_lap(setup, drive, listener, profile.duration_s + 60);
}

Result<RecordingProfile> simulate_like(const RobotSetup& setup, const RecordingProfile& like,
                                       const SimulateArgs& args, Console& console) {
  Result<SampleRecorder> recorder = start_recording(
      args.output, {.verb = "simulate", .driver = "like", .options = "like: " + yaml_text(args.like) + "\n"},
      setup);
  if (!recorder) return tl::unexpected(recorder.error());
  RecordingProfiler profiler;
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) -> Status {
    profiler.add(sample);
    if (const auto* frame = std::get_if<TagFrame>(&sample))
      console.live(
          fmt::format("{:.1f} of {:.1f} s", to_seconds(frame->stamp.time_since_epoch()), like.duration_s));
    return recorder->add(sample);
  };
  listener.should_stop = [] { return interrupted(); };
  const auto end = drive_like(setup.simulated, like, listener);
  const Status closed = recorder->close();
  console.end_progress();
  if (!end) return tl::unexpected(end.error());
  if (!closed) return tl::unexpected(closed.error());
  RecordingProfile made = profiler.profile();
  made.image_latency_s = image_latency_of(args.output, silent_control());
  return made;
}

ExitCode simulate(const SimulateArgs& args, Console& console) {
  Result<RobotSetup> setup = args.setup.make();
  Status status = setup ? args.pictures.apply(*setup) : tl::unexpected(setup.error());
  if (!status) return console.failed(status.error(), ExitCode::Usage);
  const Result<RecordingProfile> like = profile_of(args.like, silent_control());
  if (!like)
    return console.failed(like.error(), interrupted() ? ExitCode::Interrupted : ExitCode::SomeFailed);
  setup->simulated.robot = options_like(*like, setup->simulated.robot);
  const Result<RecordingProfile> made = simulate_like(*setup, *like, args, console);
  if (!made) return console.failed(made.error(), ExitCode::SomeFailed);
  const std::vector<ProfileRow> rows = profile_table(*like, *made);
  console.print(args.json ? json_line(to_json(rows, args.output)) : to_text(rows));
  return interrupted() ? ExitCode::Interrupted : ExitCode::Ok;
}

Run prepare_simulate(CLI::App& app) {
  const auto args = std::make_shared<SimulateArgs>(app);
  app.add_option(
         "--like", args->like,
         "Recording whose rates, gaps, noise and speeds are imitated: anything that `waymark info` reads")
      ->required()
      ->type_name("RECORDING");
  app.add_option("-o,--output", args->output, "Recording to write (.mcap); never written over another")
      ->required()
      ->transform(recording_name())
      ->type_name("FILE");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return simulate(*args, console); };
}

}  // namespace

Verb simulate_verb() {
  return {
      .name = "simulate",
      .sentence = "Simulate a recording with the rates, gaps, noise and speeds of a real one",
      .help =
          R"(Measures a recording: how often each sensor speaks and where it falls silent, the noise of corners, gyro and
accelerometer, how many tags are missed, how late pictures arrive, how late speeds follow commands, and how
fast the robot drove. Then lets the simulated robot drive a world's line with all of that, for as long, and
prints both side by side, measured in the same way. What a recording does not hold stays as the robot's file
says. The simulated robot has one camera: of several it takes after the one that says most. It follows a
line, and so does not turn on the spot. Keys of --json: docs/reference/cli.md.

Exit code: 0 a recording was written, 1 one could not be read or written, 2 wrong usage.

Example:
  waymark simulate --like lap.mcap --world circuit24 -o like.mcap
)",
      .prepare = prepare_simulate,
      .verbs = {}};
}

}  // namespace waymark::cli
