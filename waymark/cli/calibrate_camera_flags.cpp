#include "waymark/cli/calibrate_camera_flags.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/cli/flags.hpp"
#include "waymark/live/calibrate_guided.hpp"

namespace waymark::cli {
namespace {

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
  Refusals refused(args.settings.app());
  for (const Flag& flag : flags)
    refused.flags(std::ranges::find(flag.of, kind) == flag.of.end(), {flag.name},
                  fmt::format("this has no effect on the target {}", kind),
                  fmt::format("Leave it out, or choose --target {}.", fmt::join(flag.of, " or ")));
  return refused.status();
}

/// Flags that have no effect on what is given.
Status check_effects(const CalibrateCameraArgs& args) {
  const CalibrateCameraJob& job = args.job;
  const bool detected = !job.detections.empty();
  const char* why = "with --detections nothing is detected";
  Refusals refused(args.settings.app());
  refused.flags(detected, {"--recursive"}, why, "Leave it out, or give pictures.");
  refused.options(detected, args.views, why, "Leave it out, or give a video.");
  refused.all(detected, args.detector, why, "Leave it out, or give pictures.");
  refused.flags(!job.target.map.empty(), {"--spacing", "--first-id", "--target"},
                "this is about a board, and --map names a map", "Leave it out.");
  refused.flags(job.output.empty(), {"--format"}, "this is about --output", "Give -o, or leave it out.");
  refused.flags(job.output.empty() && job.camera_info.empty(), {"--force"}, "nothing is written",
                "Give -o, or leave it out.");
  return refused.status() ? check_target_flags(args) : refused.status();
}

/// Flags that have no effect on pictures, or on a live camera.
Status check_guided_flags(const CalibrateCameraArgs& args, bool live) {
  const bool guided = live || args.guided;
  const char* hint = "Add --guided, or give a live camera.";
  Refusals refused(args.settings.app());
  refused.flags(!live, {"--view"}, "this is about live cameras", "Leave it out.");
  refused.flags(!guided, {"--resume"}, "only a guided calibration keeps its views", hint);
  refused.options(!guided, args.guide, "only a guided calibration chooses its views so", hint);
  refused.options(guided, args.views, "a guided calibration chooses its views otherwise", "See --set guide.");
  refused.flags(guided, {"--map", "--detections"}, "a guided calibration is for boards", "Leave it out.");
  return refused.status();
}

/// What is calibrated on must be named, one way or the other.
Status check_sources(const CalibrateCameraArgs& args) {
  if (args.job.sources.empty() != args.job.detections.empty()) return {};
  if (args.job.sources.empty() && (args.guided || !args.folder.empty()))
    return fail(
        ErrorCode::InvalidArgument, "what the views are taken from is not said",
        {.key = args.folder.empty() ? "--guided" : "--resume"},
        "Name a live camera, such as v4l2:/dev/video0, or a video. The views of an earlier calibration "
        "alone are pictures: give their folder in place of a camera.");
  return fail(ErrorCode::InvalidArgument, "give either pictures, or --detections with what was detected");
}

void add_target_flags(CLI::App& app, TargetDescription& target) {
  add_option(app, "--target NAME", target.kind,
             "What is photographed: tags (`waymark tags board --style separate`), chessboard, charuco or "
             "aprilgrid (Kalibr's)",
             one_of({"tags", "chessboard", "charuco", "aprilgrid"}), kShown);
  add_option(app, "--cols INTEGER", target.columns,
             "Tags in a row of the board; of a chessboard or ChArUco board the squares, not their corners");
  add_option(
      app, "--rows INTEGER", target.rows,
      "Tags in a column of the board; of a chessboard or ChArUco board the squares, not their corners");
  add_option(app, "--tag-size-m NUMBER", target.tag_size_m,
             "Side of the black square of a tag, measured on the print");
  add_option(app, "--spacing NUMBER", target.spacing, "Gap between two tags, as a share of their size",
             kShown);
  add_option(app, "--first-id INTEGER", target.first_id,
             "Number of the lower left tag, or of the first marker", kShown, kMore);
  add_option(app, "--square-size-m NUMBER", target.square_size_m,
             "Side of a square of a chessboard or ChArUco board, measured on the print");
  add_option(app, "--marker-size-m NUMBER", target.marker_size_m,
             "Side of the black square of a ChArUco board's marker, measured on the print");
  add_option(app, "--dictionary NAME", target.dictionary,
             "Markers of a ChArUco board: OpenCV's name of their dictionary, such as 4x4_50 or 5x5_1000",
             kShown);
  add_flag(
      app, "--legacy-pattern", target.legacy_pattern,
      "A ChArUco board as OpenCV drew it before 4.6: with an even number of rows its upper left square is "
      "white",
      kMore);
  add_option(app, "--map FILE", target.map, "Instead of a board: a map of tags whose places are known well");
}

void add_output_flags(CLI::App& app, CalibrateCameraJob& job, bool& json) {
  add_option(
      app, "-o,--output FILE", job.output,
      "Calibration to write: ours (.yaml, with the standard deviations), PhotonVision's (.json), or as "
      "--format says");
  add_option(
      app, "--format NAME", job.format,
      "Format of --output: waymark, ros (camera_info), kalibr (camchain), photonvision (JSON, with all "
      "corners) or opencv (YAML of FileStorage)",
      one_of(calibration_formats()));
  add_option(app, "--camera-info FILE", job.camera_info,
             "Calibration file to write in the format of ROS camera_info", kMore);
  add_flag(app, "--force", job.force, "Replace a file that is there", kMore);
  add_flag(app, "--json", json, "One JSON object instead of tables");
}

}  // namespace

CalibrateCameraArgs::CalibrateCameraArgs(CLI::App& verb)
    : settings(verb),
      fitting(settings, "fit", "Fit"),
      views(settings, "views", "Views of a video"),
      guide(settings, "guide", "Guided calibration", Reach::SettingsOnly),
      detector(settings, kMoreGroup) {
  add_flag(
      verb, "--guided", guided,
      "Take the pictures of a video or recording as those of a live camera, until enough views are there; "
      "of a live camera they are always taken so",
      kMore);
  add_option(
      verb, "--resume FOLDER", folder,
      "Folder in which a guided calibration keeps its views as pictures, and goes on from those there");
  add_flags(verb, page,
            verb.add_flag("--view", view, "Show a live camera in the browser, with what is missing"));
  add_option(
      verb, "SOURCE", job.sources,
      "Pictures of the board: files, folders, quoted patterns, recordings, videos; or a live camera such "
      "as v4l2:/dev/video0");
  add_option(
      verb, "--detections FILE", job.detections,
      "Use this output of `waymark detect --json --covariance` instead of pictures; - is standard input",
      kMore);
  add_flag(verb, "--recursive", job.recursive, "Search folders for pictures recursively", kMore);
  add_target_flags(verb, job.target);
  add_option(verb, "--lens NAME", job.lens,
             "Distortion model: none, radtan4, radtan5, rational8, equidistant, or auto (of those that the "
             "output's format holds the simplest whose cross-validation error is as low as the best)",
             one_of({"auto", "none", "radtan4", "radtan5", "rational8", "equidistant"}), kShown);
  add_output_flags(verb, job, json);
}

Status CalibrateCameraArgs::check(bool live) const {
  Status status = check_effects(*this);
  if (status) status = check_sources(*this);
  if (status) status = check_guided_flags(*this, live);
  return status && guided && !live ? check_guided_sources(job) : status;
}

}  // namespace waymark::cli
