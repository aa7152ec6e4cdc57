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
      : settings(verb), setup(verb, {}, true), pictures(settings, Reach::SettingsOnly) {
    add_fields(verb, live);
    add_fields(verb, job);
    verb.get_option("--output")->transform(recording_name());
    add_fields(verb, anchor);
    verb.add_flag("--json", json, "One JSON object instead of words");
  }

  Settings settings;
  SetupFlags setup;
  PictureFlags pictures;
  TeachJob job{};
  LoneAnchor anchor{};
  ViewerOptions live{};
  bool json = false;
};

Result<RobotSetup> make_setup(const TeachArgs& args) {
  if (Status known = check_lap_driver(args.job.driver); !known) return tl::unexpected(known.error());
  Result<RobotSetup> made = args.pictures.apply(args.setup.make());
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
  for (const std::string& warning : report->summary.warnings) console.say("warning: " + warning);
  if (report->end.interrupted) {
    console.say(fmt::format("stopped by {}: the robot stands, and the recording is whole up to here",
                            interrupted_by()));
    return ExitCode::Interrupted;
  }
  if (!report->end.finished) console.say("the driver did not get round in ten minutes");
  return report->end.finished && report->summary.mappable ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb teach_verb() {
  return {
      .name = "teach",
      .sentence = "Record a lap that is driven once",
      .help =
          R"(The recording holds what the robot sensed (tags, odometry, wheels, IMU), what it was told, its camera,
and how it was made; the simulator adds the truth below /truth, which no estimator looks at. It opens
in Foxglove Studio as it is. `waymark info` shows what a recording holds, `waymark map` makes a map of it.
Ctrl-C stops the robot and closes the file.

With --images the camera takes pictures: rendered with motion blur, noise and distortion, and looked at by the
detector, on --threads threads; the bytes of the recording do not depend on how many. Without, corners with
noise stand for camera and detector, 2000 times as fast as the robot drives.

A person who drives (--driver keyboard, gamepad) does so in real time: the robot stops when no key is held, or
when the gamepad's left shoulder is let go. While somebody drives, the line on the terminal warns of motion
blur, of abrupt starts and stops, and of fewer than two tags; at the end it says whether the lap can be mapped,
on which few frames the map hangs, and what to do about it.

--robot process:CMD drives any robot that a program of yours speaks for (docs/formats/robot-process.md), in
real time, with keyboard or gamepad. Give its camera and body with --robot-file, and with --anchor and
--tag-size-m what the map is to stand on. Where the robot also sends the truth, --world and --driver scripted
let a script drive it.

Exit code: 0 a lap that can be mapped, 1 one that cannot, or the file could not be written, 2 wrong usage,
130 stopped by Ctrl-C.

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
