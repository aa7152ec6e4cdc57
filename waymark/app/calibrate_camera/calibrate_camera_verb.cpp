#include <utility>

#include <CLI/App.hpp>

#include "waymark/app/calibrate_camera/calibrate_camera.hpp"
#include "waymark/app/calibrate_camera/calibrate_guided.hpp"
#include "waymark/app/cli/detection_flags.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/app/live/cameras.hpp"

namespace waymark::cli {
namespace {

/// The flags of `waymark calibrate camera`. Must stay where it is while the command line is parsed.
struct CalibrateCameraArgs : CalibrateCameraWords {
  explicit CalibrateCameraArgs(CLI::App& verb);

  Settings settings;
  bool json = false;
  OptionFlags<CameraCalibrationOptions> fitting;
  OptionFlags<VideoViewOptions> views;
  OptionFlags<GuideOptions> guide;
  DetectorFlags detector;

  /// What is missing, flags without an effect, and names that promise something else. `live`: the source is a
  /// live camera.
  [[nodiscard]] Status check(bool live) const;
};

/// Options that have no effect on what is given.
Status check_options(const CalibrateCameraArgs& args, bool guided) {
  const bool detected = !args.job.detections.empty();
  const char* why = "with --detections nothing is detected";
  Refusals refused(args.settings.app());
  refused.options(detected, args.views, why, "Leave it out, or give a video.");
  refused.all(detected, args.detector, why, "Leave it out, or give pictures.");
  refused.options(!guided, args.guide, "only a guided calibration chooses its views so", kGuided);
  refused.options(guided, args.views, "a guided calibration chooses its views otherwise", "See --set guide.");
  return refused.status();
}

CalibrateCameraArgs::CalibrateCameraArgs(CLI::App& verb)
    : settings(verb),
      fitting(settings, "fit", "Fit"),
      views(settings, "views", "Views of a video"),
      guide(settings, "guide", "Guided calibration", Reach::SettingsOnly),
      detector(settings, kMoreGroup) {
  add_fields(verb, static_cast<CalibrateCameraWords&>(*this));
  verb.get_option("--format")->check(CLI::IsMember(calibration_formats()));
  verb.add_flag("--json", json, "One JSON object instead of tables");
}

Status CalibrateCameraArgs::check(bool live) const {
  const Status sound = check_effects(*this, live, given_on(settings.app()));
  return sound ? check_options(*this, live || guided) : sound;
}

/// Everything that can be wrong before a picture is read.
struct Planned {
  CalibrateCameraJob job{};
  CalibrationTarget target;
  TagFinder finder{};
  GuideOptions guide{};
  bool guided = false;
};

ExitCode code_of(const Error& error) {
  const bool of_command_line = error.code == ErrorCode::InvalidArgument && error.place.source.empty();
  return of_command_line ? ExitCode::Usage : ExitCode::SomeFailed;
}

Result<TagFinder> apply_options(const CalibrateCameraArgs& args, CalibrateCameraJob& job,
                                GuideOptions& guide) {
  Status usable = args.fitting.apply(job.options);
  if (usable) usable = args.views.apply(job.views);
  if (usable) usable = args.guide.apply(guide);
  if (!usable) return tl::unexpected(usable.error());
  return args.detector.make();
}

Result<Planned> plan(const CalibrateCameraArgs& args, CalibrateCameraJob job, TagFinder finder,
                     const GuideOptions& guide) {
  const auto live = is_only_camera(job.sources);
  if (!live) return tl::unexpected(live.error());
  if (const Status sound = args.check(*live); !sound) return tl::unexpected(sound.error());
  auto target = CalibrationTarget::make(job.target);
  if (!target) return tl::unexpected(target.error());
  if (const Status writable = check_outputs(job); !writable) return tl::unexpected(writable.error());
  return Planned{std::move(job), *std::move(target), std::move(finder), guide, *live || args.guided};
}

ExitCode calibrate(const CalibrateCameraArgs& args, Console& console) {
  CalibrateCameraJob job = args.job;
  GuideOptions guide;
  auto finder = apply_options(args, job, guide);
  if (!finder) return console.failed(finder.error(), ExitCode::Usage);
  const auto planned = plan(args, std::move(job), *std::move(finder), guide);
  if (!planned) return console.failed(planned.error(), code_of(planned.error()));
  const JobControl control = control_from(console);
  const auto report = planned->guided
                          ? calibrate_guided({.job = planned->job,
                                              .target = planned->target,
                                              .finder = planned->finder,
                                              .options = planned->guide,
                                              .folder = args.folder,
                                              .view = args.view,
                                              .page = args.page},
                                             control)
                          : calibrate_camera(planned->job, planned->target, planned->finder, control);
  if (!report) return console.failed(report.error(), ExitCode::SomeFailed);
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report));
  const Status written = write_camera_calibration(planned->job, *report);
  if (!written) return console.failed(written.error(), ExitCode::SomeFailed);
  return planned->guided && interrupted() ? ExitCode::Interrupted : ExitCode::Ok;
}

}  // namespace

Verb calibrate_camera_verb() {
  return {
      .name = "camera",
      .sentence = "Find a camera's intrinsics from pictures of a printed board",
      .help =
          R"(Print a board (`waymark tags board --style separate`), glue it on something flat, and take fifteen
pictures: near and far, in all corners of the image, tilted to the left, right, up and down by 30 degrees.
Chessboards, ChArUco boards and Kalibr's AprilGrids are targets as well (--target; found by OpenCV, which is loaded
for them; fitted as tags are).
Of a video those pictures are taken that stand still and show the board where it was not yet.
Of a live camera views are taken by themselves where the board stands still, is sharp and is where it was not yet;
each second a line says which tilt and which part of the picture is missing. It ends by itself when the camera is known
well enough; Ctrl-C ends it with the calibration by the views so far, which is written. Automatic exposure and focus are held meanwhile.
Each number comes with its standard deviation; pictures that are left out of the fit and foretold by it say how
good the camera really is. What is missing is said in words.

Exit code: 0 calibrated, 1 it could not be, or a file is there already (says why), 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark tags board --style separate --cols 6 --rows 5 --tag-size-m 0.025 --spacing 0.3 -o board.pdf
  waymark calibrate camera 'board/*.png' --cols 6 --rows 5 --tag-size-m 0.025 -o calibration.yaml
  waymark calibrate camera photos --target chessboard --cols 10 --rows 7 --square-size-m 0.025 -o calibration.yaml
  waymark calibrate camera board.mp4 --target charuco --cols 12 --rows 8 --square-size-m 0.03 --marker-size-m 0.022 \
    --dictionary 5x5_1000 -o calibration.yaml
  waymark calibrate camera v4l2:/dev/video0 --cols 6 --rows 5 --tag-size-m 0.025 --resume views --view -o calibration.yaml
  waymark detect photograph.png --camera calibration.yaml --tag-size-m 0.16
)",
      .prepare = prepared(calibrate)};
}

}  // namespace waymark::cli
