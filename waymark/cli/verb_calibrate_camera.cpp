#include <memory>
#include <string>
#include <utility>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/detector_flags.hpp"
#include "waymark/cli/file_names.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/calibrate_camera_text.hpp"
#include "waymark/jobs/json_line.hpp"

namespace waymark::cli {
namespace {

struct CalibrateCameraArgs {
  explicit CalibrateCameraArgs(CLI::App& verb)
      : app(verb),
        settings(verb),
        fitting(verb, settings, "fit", "Fit"),
        views(verb, settings, "views", "Views of a video"),
        detector(verb, settings, kMoreGroup) {}

  const CLI::App& app;
  Settings settings;
  CalibrateCameraJob job{};
  bool json = false;
  OptionFlags<CameraCalibrationOptions> fitting;
  OptionFlags<VideoViewOptions> views;
  DetectorFlags detector;
};

/// Flags that have no effect on what is given.
Status check_effects(const CalibrateCameraArgs& args) {
  Status status;
  if (!args.job.detections.empty()) {
    const char* why = "with --detections nothing is detected";
    status = refuse_flag(args.app, "--recursive", why, "Leave it out, or give pictures.");
    if (status) status = refuse(args.views, why, "Leave it out, or give a video.");
    if (status) status = args.detector.refuse_all(why, "Leave it out, or give pictures.");
  }
  for (const char* flag : {"--spacing", "--first-id"}) {
    if (status && !args.job.map.empty())
      status = refuse_flag(args.app, flag, "this is about a board, and --map names a map", "Leave it out.");
  }
  return status;
}

ExitCode calibrate(const CalibrateCameraArgs& args, Console& console) {
  const auto failed = [&](const Error& error, ExitCode code) {
    console.say(error);
    return code;
  };
  CalibrateCameraJob job = args.job;
  if (const Status usable = args.fitting.apply(job.options); !usable)
    return failed(usable.error(), ExitCode::Usage);
  if (const Status usable = args.views.apply(job.views); !usable)
    return failed(usable.error(), ExitCode::Usage);
  if (const Status effective = check_effects(args); !effective)
    return failed(effective.error(), ExitCode::Usage);
  if (job.sources.empty() == job.detections.empty())
    return failed(
        {ErrorCode::InvalidArgument, "give either pictures, or --detections with what was detected", {}, {}},
        ExitCode::Usage);
  const Result<TagMap> target = calibration_target(job);
  if (!target) return failed(target.error(), job.map.empty() ? ExitCode::Usage : ExitCode::SomeFailed);
  const auto finder = args.detector.make();
  if (!finder) return failed(finder.error(), ExitCode::Usage);
  if (const Status writable = check_outputs(job); !writable)
    return failed(writable.error(), ExitCode::SomeFailed);
  const auto report = calibrate_camera(job, *target, *finder, control_from(console));
  if (!report) return failed(report.error(), interrupted() ? ExitCode::Interrupted : ExitCode::SomeFailed);
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report));
  const Status written = write_camera_calibration(job, *report);
  return written ? ExitCode::Ok : failed(written.error(), ExitCode::SomeFailed);
}

Run prepare_calibrate_camera(CLI::App& app) {
  const auto args = std::make_shared<CalibrateCameraArgs>(app);
  app.add_option("SOURCE", args->job.sources,
                 "Pictures of the board: files, folders, quoted patterns, recordings, videos")
      ->type_name("");
  app.add_option(
         "--detections", args->job.detections,
         "Use this output of `waymark detect --json --covariance` instead of pictures; - is standard input")
      ->type_name("FILE");
  app.add_flag("--recursive", args->job.recursive, "Search folders for pictures recursively");
  app.add_option("--cols", args->job.columns, "Tags in a row of the board")->type_name("INTEGER");
  app.add_option("--rows", args->job.rows, "Tags in a column of the board")->type_name("INTEGER");
  app.add_option("--tag-size-m", args->job.tag_size_m,
                 "Side of the black square of a tag, measured on the print")
      ->type_name("NUMBER");
  app.add_option("--spacing", args->job.spacing, "Gap between two tags, as a share of their size")
      ->capture_default_str()
      ->type_name("NUMBER");
  app.add_option("--first-id", args->job.first_id, "Number of the lower left tag")
      ->capture_default_str()
      ->type_name("INTEGER");
  app.add_option("--map", args->job.map, "Instead of a board: a map of tags whose places are known well")
      ->type_name("FILE");
  app.add_option("--lens", args->job.lens,
                 "Distortion model: none, radtan4, radtan5, rational8, equidistant, or auto (the simplest "
                 "whose cross-validation error is as low as the best)")
      ->check(CLI::IsMember({"auto", "none", "radtan4", "radtan5", "rational8", "equidistant"}))
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option("-o,--output", args->job.output, "Calibration to write (calibration.yaml)")
      ->check(yaml_name())
      ->type_name("FILE");
  app.add_option("--camera-info", args->job.camera_info,
                 "Calibration file to write in the format of ROS camera_info")
      ->type_name("FILE");
  app.add_flag("--json", args->json, "One JSON object instead of tables");
  return [args](Console& console) { return calibrate(*args, console); };
}

}  // namespace

Verb calibrate_camera_verb() {
  return {
      .name = "camera",
      .sentence = "Find a camera's intrinsics from pictures of a printed board",
      .help =
          R"(Print a board (`waymark tags board --style separate`), glue it on something flat, and take fifteen
pictures: near and far, in all corners of the image, tilted to the left, right, up and down by 30 degrees.
Of a video those pictures are taken that stand still and show the board where it was not yet.
Each number comes with its standard deviation; pictures that are left out of the fit and foretold by it say how
good the camera really is. What is missing is said in words.

Exit code: 0 calibrated, 1 it could not be (says why), 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark tags board --style separate --cols 6 --rows 5 --tag-size-m 0.025 --spacing 0.3 -o board.pdf
  waymark calibrate camera 'board/*.png' --cols 6 --rows 5 --tag-size-m 0.025 -o calibration.yaml
  waymark detect photograph.png --camera calibration.yaml --tag-size-m 0.16
)",
      .prepare = prepare_calibrate_camera,
      .verbs = {}};
}

}  // namespace waymark::cli
