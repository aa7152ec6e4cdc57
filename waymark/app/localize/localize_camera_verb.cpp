#include "waymark/app/cli/localize_parts.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/localize/localize_camera.hpp"
#include "waymark/app/localize/localize_lines.hpp"

namespace waymark::cli {
namespace {

struct LocalizeCameraArgs {
  explicit LocalizeCameraArgs(CLI::App& verb) {
    add_fields(verb, job);
    add_field(verb, every_s, localize_fields::every_s());
    add_fields(verb, view);
    verb.add_flag("--json", json, "Print JSON lines instead of text");
  }

  LocalizeCameraJob job{};
  double every_s = 1;
  ViewerOptions view{};
  bool json = false;
};

ExitCode localize_by_camera(const LocalizeCameraArgs& args, Console& console) {
  LocalizeCameraJob job = args.job;
  const Result<CameraModel> model = read_camera(job);
  if (!model) return fail_with(model.error(), console);
  const auto camera = open_live_camera(job.source);
  if (!camera) return fail_with(camera.error(), console);
  console.note((*camera)->description());
  const auto view = LivePage::open(args.view, (*camera)->description(), control_from(console));
  if (!view) return fail_with(view.error(), console);
  if (*view) job.feed = &(*view)->feed();
  MomentLines lines(args.every_s, args.json, [&console](const std::string& line) { console.print(line); });
  job.on_moment = [&lines](const CameraMoment& moment) { lines.take(moment); };
  const auto report = localize_camera(**camera, *model, job, control_of_lines(console));
  if (!report) return fail_with(report.error(), console);
  console.note(to_text(*report));
  if (report->end.stopped && interrupted()) return ExitCode::Interrupted;
  return report->known > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb localize_camera_verb() {
  return {
      .name = "camera",
      .sentence = "Print the pose of a live camera without a robot",
      .help =
          R"(Repeatedly detects the tags in the newest image from the camera, and computes the camera's pose in six degrees of
freedom from that image alone, without filter or initial pose. Prints the pose once per second until Ctrl-C. The camera
body has x forward, y left, z up.
With -o FILE.mcap, the program records tags and poses (/waymark/pose) with stamps since 1970; with --record-images, also
the images. With -o FILE.tum, it writes one pose per line. --view shows the camera in the browser. For several cameras,
run the program once per camera.

The calibration (--camera) must match the image size; --camera-size scales a calibration that was made at a different
size. `waymark calibrate camera` makes a calibration, and `waymark cameras` lists the cameras on this computer.

Exit code: 0 at least one pose computed, 1 none, or a file or the camera was unusable, 2 wrong usage,
130 stopped by Ctrl-C (the recording is kept).

Examples:
  waymark localize v4l2:/dev/video0 --camera calibration.yaml --map map --view
  waymark localize v4l2:/dev/video0 --camera calibration.yaml --map map -o hand.mcap --duration-s 60
)",
      .prepare = prepared(localize_by_camera),
      .report = report_of<CameraMoment>};
}

}  // namespace waymark::cli
