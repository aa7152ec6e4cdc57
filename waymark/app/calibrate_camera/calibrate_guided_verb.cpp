#include <CLI/App.hpp>

#include "waymark/app/calibrate_camera/calibrate_guided.hpp"
#include "waymark/app/cli/calibration_flags.hpp"
#include "waymark/app/cli/detection_flags.hpp"
#include "waymark/app/cli/parts.hpp"

namespace waymark::cli {
namespace {

/// The flags of `waymark calibrate guided`. Must not be moved in memory while the command line is parsed.
struct CalibrateGuidedArgs {
  explicit CalibrateGuidedArgs(CLI::App& verb)
      : settings(verb),
        fitting(settings, "fit", "Fit"),
        guide(settings, "guide", "Guided calibration", Reach::SettingsOnly),
        detector(settings, kMoreGroup) {
    add_fields(verb, job);
    verb.add_flag("--json", json, "One JSON object instead of tables");
    add_choice(verb, "--guided");
  }

  Settings settings;
  CalibrateGuidedJob job{};
  bool json = false;
  OptionFlags<CameraCalibrationOptions> fitting;
  OptionFlags<GuideOptions> guide;
  DetectorFlags detector;
};

ExitCode calibrate_by_guide(const CalibrateGuidedArgs& args, Console& console) {
  CalibrateGuidedJob job = args.job;
  Status usable = args.fitting.apply(job.fit.options);
  if (usable) usable = args.guide.apply(job.guide);
  const auto finder = usable ? args.detector.make() : Result<TagFinder>(tl::unexpected(usable.error()));
  if (!finder) return fail_usage(finder.error(), console);
  if (const Status valid = check_job(job, given_on(args.settings.app())); !valid)
    return fail_by_kind(valid.error(), console);
  const auto target = usable_target(job.target, job.fit);
  if (!target) return fail_by_kind(target.error(), console);
  const auto report = calibrate_guided(job, *target, *finder, control_from(console));
  const ExitCode code = print_and_write(report, job.fit, args.json, console);
  return code == ExitCode::Ok && interrupted() ? ExitCode::Interrupted : code;
}

}  // namespace

Verb calibrate_guided_verb() {
  return {
      .name = "guided",
      .sentence = "Estimate a camera's intrinsics while you hold a printed board in front of it",
      .help =
          R"(Print a board (`waymark tags board --style separate`), glue it to a flat plate, and hold it in front of the camera. A
view is taken automatically when the board is at rest, in focus and in a new position. Once per second, the missing
tilts and parts of the image are printed; with --view, they are shown in the browser. The program ends when the
calibration is accurate enough. After Ctrl-C, it writes the calibration obtained from the views so far. Automatic
exposure and focus are fixed during the calibration.

With --resume FOLDER, the views are stored in this folder as images, and an earlier calibration is continued from them.
To use only these images, run `waymark calibrate camera FOLDER`. A video or recording is treated like the images of a
live camera. The target is a board; for a tag map (--map) or detections, use `waymark calibrate camera`.

Exit code: 0 calibrated, 1 failed, or the file already exists (prints the reason), 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark calibrate guided v4l2:/dev/video0 --cols 6 --rows 5 --tag-size-m 0.025 --resume views --view -o calibration.yaml
  waymark calibrate guided board.mp4 --cols 6 --rows 5 --tag-size-m 0.025 -o calibration.yaml
)",
      .prepare = prepared(calibrate_by_guide),
      .report = report_of<CalibrateCameraReport>};
}

}  // namespace waymark::cli
