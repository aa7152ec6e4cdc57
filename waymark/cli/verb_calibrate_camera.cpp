#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/detector_flags.hpp"
#include "waymark/cli/file_names.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/page_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/calibrate_camera_text.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/live/calibrate_guided.hpp"
#include "waymark/live/camera_address.hpp"

namespace waymark::cli {
namespace {

struct CalibrateCameraArgs {
  explicit CalibrateCameraArgs(CLI::App& verb)
      : app(verb),
        settings(verb),
        fitting(verb, settings, "fit", "Fit"),
        views(verb, settings, "views", "Views of a video"),
        guide(verb, settings, "guide", "Guided calibration", Reach::SettingsOnly),
        detector(verb, settings, kMoreGroup) {
    verb.add_flag(
            "--guided", guided,
            "Take the pictures of a video or recording as those of a live camera, until enough views are "
            "there; of a live camera they are always taken so")
        ->group(kMoreGroup);
    verb.add_option(
            "--resume", folder,
            "Folder in which a guided calibration keeps its views as pictures, and goes on from those there")
        ->type_name("FOLDER");
    add_flags(verb, page,
              verb.add_flag("--view", view, "Show a live camera in the browser, with what is missing"));
  }

  const CLI::App& app;
  Settings settings;
  CalibrateCameraJob job{};
  bool json = false;
  bool guided = false;
  std::string folder{};
  bool view = false;
  PageOptions page{};
  OptionFlags<CameraCalibrationOptions> fitting;
  OptionFlags<VideoViewOptions> views;
  OptionFlags<GuideOptions> guide;
  DetectorFlags detector;
};

/// Flags that have no effect on this target.
Status check_target_flags(const CalibrateCameraArgs& args) {
  const std::string& kind = args.job.target.kind;
  struct Flag {
    const char* name;
    std::vector<std::string> of;
  };
  const std::vector<Flag> flags = {{"--tag-size-m", {"tags", "aprilgrid"}},
                                   {"--spacing", {"tags", "aprilgrid"}},
                                   {"--square-size-m", {"chessboard", "charuco"}},
                                   {"--marker-size-m", {"charuco"}},
                                   {"--dictionary", {"charuco"}},
                                   {"--legacy-pattern", {"charuco"}},
                                   {"--first-id", {"tags", "aprilgrid", "charuco"}},
                                   {"--detections", {"tags"}}};
  Status status;
  for (const Flag& flag : flags)
    if (status && std::ranges::find(flag.of, kind) == flag.of.end())
      status = refuse_flag(args.app, flag.name, fmt::format("the target {} has no such thing", kind),
                           fmt::format("Leave it out, or choose --target {}.", fmt::join(flag.of, " or ")));
  return status;
}

/// Flags that have no effect on what is given.
Status check_effects(const CalibrateCameraArgs& args) {
  Status status;
  if (!args.job.detections.empty()) {
    const char* why = "with --detections nothing is detected";
    status = refuse_flag(args.app, "--recursive", why, "Leave it out, or give pictures.");
    if (status) status = refuse(args.views, why, "Leave it out, or give a video.");
    if (status) status = args.detector.refuse_all(why, "Leave it out, or give pictures.");
  }
  for (const char* flag : {"--spacing", "--first-id", "--target"}) {
    if (status && !args.job.target.map.empty())
      status = refuse_flag(args.app, flag, "this is about a board, and --map names a map", "Leave it out.");
  }
  return status ? check_target_flags(args) : status;
}

/// Flags that have no effect on pictures, or on a live camera.
Status check_guided_flags(const CalibrateCameraArgs& args, bool live) {
  Status status;
  if (!live) status = refuse_flag(args.app, "--view", "this is about live cameras", "Leave it out.");
  if (status && !live && !args.guided)
    status = refuse_flag(args.app, "--resume", "only a guided calibration keeps its views",
                         "Add --guided, or give a live camera.");
  if (status && !live && !args.guided)
    status = refuse(args.guide, "only a guided calibration chooses its views so",
                    "Add --guided, or give a live camera.");
  if (status && (live || args.guided))
    status = refuse(args.views, "a guided calibration chooses its views otherwise", "See --set guide.");
  for (const char* flag : {"--map", "--detections"})
    if (status && (live || args.guided))
      status = refuse_flag(args.app, flag, "a guided calibration is for boards", "Leave it out.");
  return status;
}

/// The ending of the output must not promise another format.
Status check_ending(const CalibrateCameraJob& job) {
  const std::filesystem::path output(job.output);
  if (job.output.empty() || is_device(job.output)) return {};
  const std::string ending = output.extension().string();
  const bool yaml = ending == ".yaml" || ending == ".yml";
  const bool json = ending == ".json" && (job.format.empty() || job.format == "photonvision");
  if (json || (yaml && job.format != "photonvision")) return {};
  return fail(ErrorCode::InvalidArgument,
              fmt::format("{} is no name for a calibration{}", job.output,
                          job.format.empty() ? "" : " of the format " + job.format),
              {.key = "--output"}, "End it in .yaml, or in .json for PhotonVision.");
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
  if (const Status named = check_ending(job); !named) return failed(named.error(), ExitCode::Usage);
  const Result<CalibrationTarget> target = CalibrationTarget::make(job.target);
  if (!target)
    return failed(target.error(), target.error().code == ErrorCode::InvalidArgument && job.target.map.empty()
                                      ? ExitCode::Usage
                                      : ExitCode::SomeFailed);
  GuideOptions guide;
  if (const Status usable = args.guide.apply(guide); !usable) return failed(usable.error(), ExitCode::Usage);
  const auto live = is_only_camera(job.sources);
  if (!live) return failed(live.error(), ExitCode::Usage);
  const bool guided = *live || args.guided;
  if (const Status effective = check_guided_flags(args, *live); !effective)
    return failed(effective.error(), ExitCode::Usage);
  const auto finder = args.detector.make();
  if (!finder) return failed(finder.error(), ExitCode::Usage);
  if (const Status writable = check_outputs(job); !writable)
    return failed(writable.error(), ExitCode::SomeFailed);
  const auto report = guided ? calibrate_guided({.job = job,
                                                 .target = *target,
                                                 .finder = *finder,
                                                 .options = guide,
                                                 .folder = args.folder,
                                                 .view = args.view,
                                                 .page = args.page},
                                                control_from(console))
                             : calibrate_camera(job, *target, *finder, control_from(console));
  if (!report) return failed(report.error(), interrupted() ? ExitCode::Interrupted : ExitCode::SomeFailed);
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report));
  const Status written = write_camera_calibration(job, *report);
  return written ? ExitCode::Ok : failed(written.error(), ExitCode::SomeFailed);
}

void add_target_flags(CLI::App& app, TargetDescription& target) {
  app.add_option("--target", target.kind,
                 "What is photographed: tags (`waymark tags board --style separate`), chessboard, charuco or "
                 "aprilgrid (Kalibr's)")
      ->check(CLI::IsMember({"tags", "chessboard", "charuco", "aprilgrid"}))
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option(
         "--cols", target.columns,
         "Tags in a row of the board; of a chessboard or ChArUco board the squares, not their corners")
      ->type_name("INTEGER");
  app.add_option("--rows", target.rows, "Tags, or squares, in a column of the board")->type_name("INTEGER");
  app.add_option("--tag-size-m", target.tag_size_m,
                 "Side of the black square of a tag, measured on the print")
      ->type_name("NUMBER");
  app.add_option("--spacing", target.spacing, "Gap between two tags, as a share of their size")
      ->capture_default_str()
      ->type_name("NUMBER");
  app.add_option("--first-id", target.first_id, "Number of the lower left tag, or of the first marker")
      ->group(kMoreGroup)
      ->capture_default_str()
      ->type_name("INTEGER");
  app.add_option("--square-size-m", target.square_size_m,
                 "Side of a square of a chessboard or ChArUco board, measured on the print")
      ->type_name("NUMBER");
  app.add_option("--marker-size-m", target.marker_size_m,
                 "Side of the black square of a ChArUco board's marker, measured on the print")
      ->type_name("NUMBER");
  app.add_option("--dictionary", target.dictionary,
                 "Markers of a ChArUco board: OpenCV's name of their dictionary, such as 4x4_50 or 5x5_1000")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_flag(
         "--legacy-pattern", target.legacy_pattern,
         "A ChArUco board as OpenCV drew it before 4.6: with an even number of rows its upper left square is "
         "white")
      ->group(kMoreGroup);
  app.add_option("--map", target.map, "Instead of a board: a map of tags whose places are known well")
      ->type_name("FILE");
}

Run prepare_calibrate_camera(CLI::App& app) {
  const auto args = std::make_shared<CalibrateCameraArgs>(app);
  app.add_option("SOURCE", args->job.sources,
                 "Pictures of the board: files, folders, quoted patterns, recordings, videos; or a live "
                 "camera such as "
                 "v4l2:/dev/video0")
      ->type_name("");
  app.add_option(
         "--detections", args->job.detections,
         "Use this output of `waymark detect --json --covariance` instead of pictures; - is standard input")
      ->group(kMoreGroup)
      ->type_name("FILE");
  app.add_flag("--recursive", args->job.recursive, "Search folders for pictures recursively")
      ->group(kMoreGroup);
  add_target_flags(app, args->job.target);
  app.add_option("--lens", args->job.lens,
                 "Distortion model: none, radtan4, radtan5, rational8, equidistant, or auto (the simplest "
                 "whose cross-validation error is as low as the best)")
      ->check(CLI::IsMember({"auto", "none", "radtan4", "radtan5", "rational8", "equidistant"}))
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option(
         "-o,--output", args->job.output,
         "Calibration to write: ours (.yaml, with the standard deviations), PhotonVision's (.json), or as "
         "--format says")
      ->type_name("FILE");
  app.add_option(
         "--format", args->job.format,
         "Format of --output: waymark, ros (camera_info), kalibr (camchain), photonvision (JSON, with all "
         "corners) or opencv (YAML of FileStorage)")
      ->check(CLI::IsMember(calibration_formats()))
      ->type_name("NAME");
  app.add_option("--camera-info", args->job.camera_info,
                 "Calibration file to write in the format of ROS camera_info")
      ->group(kMoreGroup)
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
Chessboards, ChArUco boards and Kalibr's AprilGrids are targets as well (--target; found by OpenCV, which is loaded
for them; fitted as tags are).
Of a video those pictures are taken that stand still and show the board where it was not yet.
Of a live camera views are taken by themselves where the board stands still, is sharp and is where it was not yet;
each second a line says which tilt and which part of the picture is missing. It ends by itself when the camera is known
well enough, or on Ctrl-C with the views so far. Automatic exposure and focus are held meanwhile.
Each number comes with its standard deviation; pictures that are left out of the fit and foretold by it say how
good the camera really is. What is missing is said in words.

Exit code: 0 calibrated, 1 it could not be (says why), 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark tags board --style separate --cols 6 --rows 5 --tag-size-m 0.025 --spacing 0.3 -o board.pdf
  waymark calibrate camera 'board/*.png' --cols 6 --rows 5 --tag-size-m 0.025 -o calibration.yaml
  waymark calibrate camera photos --target chessboard --cols 10 --rows 7 --square-size-m 0.025 -o calibration.yaml
  waymark calibrate camera board.mp4 --target charuco --cols 12 --rows 8 --square-size-m 0.03 --marker-size-m 0.022 \
    --dictionary 5x5_1000 -o calibration.yaml
  waymark calibrate camera v4l2:/dev/video0 --cols 6 --rows 5 --tag-size-m 0.025 --resume views --view -o calibration.yaml
  waymark detect photograph.png --camera calibration.yaml --tag-size-m 0.16
)",
      .prepare = prepare_calibrate_camera,
      .verbs = {}};
}

}  // namespace waymark::cli
