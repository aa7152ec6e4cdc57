#include <CLI/App.hpp>

#include "waymark/app/calibrate_camera/calibrate_guided.hpp"
#include "waymark/app/cli/calibration_flags.hpp"
#include "waymark/app/cli/detection_flags.hpp"
#include "waymark/app/cli/parts.hpp"

namespace waymark::cli {
namespace {

/// The flags of `waymark calibrate guided`. Must stay where it is while the command line is parsed.
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
  if (const Status sound = check_job(job, given_on(args.settings.app())); !sound)
    return fail_by_kind(sound.error(), console);
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
      .sentence = "Find a camera's intrinsics while you hold a printed board before it",
      .help =
          R"(Print a board (`waymark tags board --style separate`), glue it on something flat, and hold it before the camera. A
view is taken by itself where the board stands still, is sharp and is where it was not yet; each second a line says
which tilt and which part of the picture is missing, and with --view the page in the browser shows it. It ends by
itself when the camera is known well enough; Ctrl-C ends it with the calibration by the views so far, which is written.
Automatic exposure and focus are held meanwhile.
With --resume FOLDER the views are kept there as pictures, and an earlier calibration goes on from them; the pictures
alone are calibrated by `waymark calibrate camera FOLDER`. A video or recording is taken as the pictures of a live
camera. The target is a board; a map of tags (--map) and detections are for `waymark calibrate camera`.

Exit code: 0 calibrated, 1 it could not be, or a file is there already (says why), 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark calibrate guided v4l2:/dev/video0 --cols 6 --rows 5 --tag-size-m 0.025 --resume views --view -o calibration.yaml
  waymark calibrate guided board.mp4 --cols 6 --rows 5 --tag-size-m 0.025 -o calibration.yaml
)",
      .prepare = prepared(calibrate_by_guide),
      .report = report_of<CalibrateCameraReport>};
}

}  // namespace waymark::cli
