#include <algorithm>

#include <fmt/format.h>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/teach/teach_lap.hpp"

namespace waymark::cli {
namespace {

struct TeachArgs {
  explicit TeachArgs(CLI::App& verb)
      : settings(verb), setup(verb, {}, true), images(settings, Reach::SettingsOnly) {
    add_fields(verb, live);
    add_fields(verb, job);
    verb.get_option("--output")->transform(recording_name());
    add_fields(verb, anchor);
    verb.add_flag("--json", json, "Print one JSON object instead of text");
  }

  Settings settings;
  SetupFlags setup;
  ImageFlags images;
  TeachJob job{};
  LoneAnchor anchor{};
  ViewerOptions live{};
  bool json = false;
};

Result<RobotSetup> make_setup(const TeachArgs& args) {
  if (Status valid = check_lap_driver(args.job.driver); !valid) return tl::unexpected(valid.error());
  Result<RobotSetup> made = args.images.apply(args.setup.make());
  if (!made) return made;
  if (Status placed = place_lone_anchor(*made, args.anchor); !placed) return tl::unexpected(placed.error());
  return made;
}

ExitCode teach(const TeachArgs& args, Console& console) {
  const Result<RobotSetup> setup = make_setup(args);
  if (!setup) return fail_usage(setup.error(), console);
  TeachJob job = args.job;
  if (args.settings.app().count("--speed-m-s") == 0)
    job.speed_m_s = std::min(job.speed_m_s, setup->simulated.model.limits.speed_m_s);
  Status status = check_teach(job, *setup);
  if (status) status = check_effects(job, *setup, given_on(args.settings.app()));
  if (!status) return fail_usage(status.error(), console);
  const auto view = LivePage::open(args.live, *setup, control_from(console));
  if (!view) return fail_with(view.error(), console);
  if (*view) job.feed = &(*view)->feed();
  const auto stop = setup->process.empty() ? nullptr : listen_for_stop("teach into " + job.output, console);
  const Result<TeachReport> report = teach_lap(*setup, job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report))
                          : to_text(*report, setup->simulated.world.path_closed));
  for (const std::string& warning : report->summary.warnings) console.note("warning: " + warning);
  if (report->end.interrupted) {
    console.note(
        fmt::format("stopped by {}: the robot is stationary, and the recording is complete up to this point",
                    interrupted_by()));
    return ExitCode::Interrupted;
  }
  if (!report->end.finished) console.note("the driver did not complete the lap in ten minutes");
  return report->end.finished && report->summary.mappable ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb teach_verb() {
  return {
      .name = "teach",
      .sentence = "Record a lap that is driven once",
      .help =
          R"(The recording contains sensor data (tags, odometry, wheels, IMU), commands, the camera, and metadata; the
simulator adds ground truth below /truth, which no estimator reads. Foxglove Studio opens it directly.
`waymark info` lists the contents of a recording, and `waymark map` maps it. Ctrl-C stops the robot and closes the
file.
With --images the camera renders images with motion blur, noise and distortion, and the detector runs on them,
on --threads threads. The bytes of the recording do not depend on the number of threads. Without --images, noisy
corners replace camera and detector, 2000 times faster than real time.
A person (--driver keyboard, gamepad) drives in real time. The robot stops if no key is held, or if the left
shoulder button of the gamepad is released. During the drive the terminal warns of motion blur, of abrupt starts
and stops, and of fewer than two tags. At the end the report states whether the lap can be mapped. It also lists
the frames that are the only link between parts of the map, and how to fix that.
The flag --robot process:CMD drives any robot with a driver program (docs/formats/robot-process.md), in real time,
with keyboard or gamepad. The robot file describes its camera and body; --anchor and --tag-size-m define the map frame
and the scale. If the robot also sends ground truth, a script can drive it with --world and --driver scripted.
Exit code: 0 the lap can be mapped, 1 it cannot, or the file could not be written, 2 wrong usage, 130 stopped by
Ctrl-C.


Examples:
  waymark teach --robot sim --world circuit24 --driver scripted --seed 1 -o lap.mcap
  waymark teach --world circuit24 --seed 2 -o lap2.mcap --json
  waymark teach --world circuit24 --images --set camera.exposure_ms=20 -o dim.mcap
  waymark teach --world limo-walls --driver keyboard -o mine.mcap
  waymark teach --robot "process:python3 my_robot.py" --robot-file my_robot.yaml --anchor 0 --tag-size-m 0.16 \
    --driver gamepad -o mine.mcap
)",
      .prepare = prepared(teach),
      .report = report_of<TeachReport>};
}

}  // namespace waymark::cli
