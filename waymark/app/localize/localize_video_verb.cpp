#include "waymark/app/cli/parts.hpp"
#include "waymark/app/localize/localize_lines.hpp"
#include "waymark/app/localize/localize_video.hpp"

namespace waymark::cli {
namespace {

struct LocalizeVideoArgs {
  explicit LocalizeVideoArgs(CLI::App& verb) {
    add_fields(verb, job);
    add_field(verb, every_s, localize_fields::every_s());
    verb.add_flag("--json", json, "JSON lines instead of words");
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
  for (const VideoProblem& problem : report->video.problems) console.say(to_string(problem.error));
  console.say(to_text(*report));
  return report->known > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb localize_video_verb() {
  return {
      .name = "video",
      .sentence = "Compute where the camera of a video was",
      .help =
          R"(Finds the tags of every picture and computes the pose of the camera in six degrees of freedom from them: there is
no robot, no filter and no start. The rows of a rolling shutter (--readout-ms) and an error that all corners share are
taken into account over the whole video. The body of the camera has x forward, y left, z up. Prints a line a second of
the video, with the times of the video. With -o FILE.mcap tags, poses (/waymark/pose) and the camera are recorded; with
-o FILE.tum each pose is a line. The output appears whole or not at all.

VIDEO may also be the recording of a camera without a robot (`waymark convert`), which holds tags or pictures, and neither
odometry nor an IMU. Run the program once for each video.

The calibration (--camera) must be of the pictures' size; --camera-size scales one that was made at another size.
`waymark calibrate camera` makes one.

Exit code: 0 the place was known in some picture, 1 in none, or a file was unusable, 2 wrong usage, 130 stopped by
Ctrl-C (nothing is written then).

Examples:
  waymark localize walk.mp4 --camera calibration.yaml --map map -o walk.tum
  waymark localize desk.mcap --camera calibration.yaml --map map --json
)",
      .prepare = prepared(localize_by_video),
      .report = report_of<CameraMoment>};
}

}  // namespace waymark::cli
