#include "waymark/app/cli/parts.hpp"
#include "waymark/app/localize/localize_lines.hpp"
#include "waymark/app/localize/localize_video.hpp"

namespace waymark::cli {
namespace {

struct LocalizeVideoArgs {
  explicit LocalizeVideoArgs(CLI::App& verb) {
    add_fields(verb, job);
    add_field(verb, every_s, localize_fields::every_s());
    verb.add_flag("--json", json, "Print JSON lines instead of text");
  }

  LocalizeVideoJob job{};
  double every_s = 1;
  bool json = false;
};

ExitCode localize_by_video(const LocalizeVideoArgs& args, Console& console) {
  LocalizeVideoJob job = args.job;
  MomentLines lines(args.every_s, args.json, [&console](const std::string& line) { console.print(line); });
  job.on_moment = [&lines](const CameraMoment& moment) { lines.take(moment); };
  const auto report = localize_video(job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  for (const VideoProblem& problem : report->video.problems) console.note(to_string(problem.error));
  console.note(to_text(*report));
  return report->known > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb localize_video_verb() {
  return {
      .name = "video",
      .sentence = "Compute the camera poses in a video",
      .help =
          R"(Detects the tags in every image and computes the camera's pose in six degrees of freedom from them, without
robot, filter or initial pose. A rolling shutter (--readout-ms) and an error common to all corners are modelled over the
whole video. The camera body has x forward, y left, z up. Prints one line per second of video time. With -o FILE.mcap,
the program records tags, poses (/waymark/pose) and the camera; with -o FILE.tum, it writes one pose per line. The
output is written completely or not at all.

VIDEO may also be the recording of a camera without a robot (`waymark convert`), with tags or images but neither
odometry nor an IMU. The program processes one video per run.

The calibration (--camera) must match the image size; --camera-size scales a calibration that was made at a different
size. `waymark calibrate camera` makes a calibration.

Exit code: 0 at least one pose computed, 1 none, or a file was unusable, 2 wrong usage, 130 stopped by
Ctrl-C (nothing is written then).

Examples:
  waymark localize walk.mp4 --camera calibration.yaml --map map -o walk.tum
  waymark localize desk.mcap --camera calibration.yaml --map map --json
)",
      .prepare = prepared(localize_by_video),
      .report = report_of<CameraMoment>};
}

}  // namespace waymark::cli
