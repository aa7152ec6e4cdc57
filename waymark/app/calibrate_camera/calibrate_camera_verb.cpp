#include <algorithm>

#include <CLI/App.hpp>

#include "waymark/app/calibrate_camera/calibrate_camera.hpp"
#include "waymark/app/cli/calibration_flags.hpp"
#include "waymark/app/cli/detection_flags.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/app/live/cameras.hpp"

namespace waymark::cli {
namespace {

/// The flags of `waymark calibrate camera`. Must not be moved in memory while the command line is parsed.
struct CalibrateCameraArgs {
  explicit CalibrateCameraArgs(CLI::App& verb)
      : settings(verb),
        fitting(settings, "fit", "Fit"),
        views(settings, "views", "Views of a video"),
        detector(settings, kMoreGroup) {
    add_fields(verb, job);
    verb.add_flag("--json", json, "One JSON object instead of tables");
  }

  Settings settings;
  CalibrateCameraJob job{};
  bool json = false;
  OptionFlags<CameraCalibrationOptions> fitting;
  OptionFlags<VideoViewOptions> views;
  DetectorFlags detector;
};

Status check(const CalibrateCameraArgs& args) {
  if (Status valid = check_job(args.job, given_on(args.settings.app())); !valid) return valid;
  const bool detected = !args.job.detections.empty();
  const char* reason = "with `detections` nothing is detected";
  Refusals refused(args.settings.app());
  refused.options(detected, args.views, reason, "Omit this option, or give a video.");
  refused.all(detected, args.detector, reason, "Omit this option, or give images.");
  return refused.status();
}

ExitCode calibrate_by_images(const CalibrateCameraArgs& args, Console& console) {
  CalibrateCameraJob job = args.job;
  Status usable = args.fitting.apply(job.fit.options);
  if (usable) usable = args.views.apply(job.views);
  const auto finder = usable ? args.detector.make() : Result<TagFinder>(tl::unexpected(usable.error()));
  if (!finder) return fail_usage(finder.error(), console);
  if (const Status valid = check(args); !valid) return fail_by_kind(valid.error(), console);
  const auto target = usable_target(job.target, job.fit);
  if (!target) return fail_by_kind(target.error(), console);
  return print_and_write(calibrate_camera(job, *target, *finder, control_from(console)), job.fit, args.json,
                         console);
}

/// "guided" if the words include a live camera or an option for guided calibration, else "camera".
std::string implied_verb(const std::vector<std::string>& words) {
  const bool guided = has_word(words, "--guided") || has_word(words, "--resume") ||
                      std::ranges::any_of(words, is_camera_address);
  return guided ? "guided" : "camera";
}

}  // namespace

Verb calibrate_camera_verb() {
  return {
      .name = "camera",
      .sentence = "Estimate a camera's intrinsics from images of a printed board",
      .help =
          R"(Print a board (`waymark tags board --style separate`), glue it to a flat plate, and take fifteen images. Take them from
near and far, with the board in all corners of the image, and tilted to the left, right, up and down by 30 degrees.
Chessboards, ChArUco boards and AprilGrids (Kalibr) are supported as well (--target); they are detected with OpenCV,
which is loaded on demand. In a video, images are used if the board is at rest and in a new position.

The program prints each parameter with its standard deviation, and lists missing views. The error in held-out images
shows the real accuracy.

With a live camera, such as v4l2:/dev/video0, or with --guided or --resume, this verb runs `waymark calibrate guided`,
which takes the views automatically and lists missing ones.

Exit code: 0 calibrated, 1 failed, or the file already exists (prints the reason), 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark tags board --style separate --cols 6 --rows 5 --tag-size-m 0.025 --spacing 0.3 -o board.pdf
  waymark calibrate camera 'board/*.png' --cols 6 --rows 5 --tag-size-m 0.025 -o calibration.yaml
  waymark calibrate camera photos --target chessboard --cols 10 --rows 7 --square-size-m 0.025 -o calibration.yaml
  waymark calibrate camera board.mp4 --target charuco --cols 12 --rows 8 --square-size-m 0.03 --marker-size-m 0.022 \
    --dictionary 5x5_1000 -o calibration.yaml
  waymark detect photograph.png --camera calibration.yaml --tag-size-m 0.16
)",
      .prepare = prepared(calibrate_by_images),
      .report = report_of<CalibrateCameraReport>,
      .usual_verb = implied_verb};
}

}  // namespace waymark::cli
