#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/camera_calibration_report.hpp"
#include "waymark/cli/detect_all.hpp"
#include "waymark/cli/detector_flags.hpp"
#include "waymark/cli/file_names.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/calibration_file.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/families/family.hpp"
#include "waymark/jobs/staged_folder.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark::cli {
namespace {

struct CalibrateCameraArgs {
  explicit CalibrateCameraArgs(CLI::App& app) : fitting(app, "Fit"), detector(app) {}

  std::vector<std::string> sources;
  std::string detections;
  bool recursive = false;
  int columns = 0;
  int rows = 0;
  double tag_size_m = 0;
  double spacing = 0.3;
  int first_id = 0;
  std::string map;
  std::string lens = "auto";
  std::string output;
  std::string camera_info;
  bool json = false;
  OptionFlags<CameraCalibrationOptions> fitting;
  DetectorFlags detector;
};

/// The tags of a board as `waymark tags board` draws it: numbers from the lower left to the right, then up.
/// Origin in its middle, x right, y down.
TagMap board_of(const CalibrateCameraArgs& args) {
  const double pitch_m = args.tag_size_m * (1 + args.spacing);
  TagMap board;
  for (int row = 0; row < args.rows; ++row) {
    for (int column = 0; column < args.columns; ++column) {
      const double x_m = pitch_m * (column - 0.5 * (args.columns - 1));
      const double y_m = -pitch_m * (row - 0.5 * (args.rows - 1));
      board.tags.emplace(TagId{FamilyId::Tag36h11, args.first_id + row * args.columns + column},
                         MappedTag{.map_T_tag = SE3(SO3(), {x_m, y_m, 0}), .size_m = args.tag_size_m});
    }
  }
  return board;
}

Result<TagMap> target_of(const CalibrateCameraArgs& args) {
  const bool board = args.columns > 0 || args.rows > 0 || args.tag_size_m != 0;
  if (board != args.map.empty())
    return fail(ErrorCode::InvalidArgument,
                "give either the board (--cols, --rows, --tag-size-m) or a map of tags (--map)");
  if (!args.map.empty()) return read_map(args.map).map([](const MapFile& map) { return map.tags; });
  if (args.columns < 1 || args.rows < 1 || !is_tag_size(args.tag_size_m))
    return fail(ErrorCode::InvalidArgument,
                "a board has --cols and --rows of 1 or more and a --tag-size-m above 0", {},
                "Measure the black square of a tag with a ruler.");
  const auto ids = static_cast<std::int64_t>(family(FamilyId::Tag36h11).codes.size());
  const std::int64_t last = args.first_id + static_cast<std::int64_t>(args.columns) * args.rows - 1;
  if (args.first_id < 0 || last >= ids)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the board would carry the tags {} to {}, and there are 0 to {}", args.first_id,
                            last, ids - 1),
                {}, "Look at --cols, --rows and --first-id.");
  return board_of(args);
}

/// The pictures that could be looked at, all of one size.
struct SeenPictures {
  std::vector<std::string> names{};
  std::vector<std::vector<TagDetection>> detections{};
  int width_px = 0;
  int height_px = 0;
};

Status add_picture(PictureReport& report, SeenPictures& seen) {
  if (report.error || !report.detected) return {};
  if (seen.names.empty()) {
    seen.width_px = report.width_px;
    seen.height_px = report.height_px;
  }
  if (report.width_px != seen.width_px || report.height_px != seen.height_px)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} x {} pixels, but {} has {} x {}", report.width_px, report.height_px,
                            seen.names.front(), seen.width_px, seen.height_px),
                {.source = report.image}, "Calibrate with pictures of one camera in one resolution.");
  seen.names.push_back(report.image);
  seen.detections.push_back(std::move(report.detections));
  return {};
}

Result<SeenPictures> from_pictures(const CalibrateCameraArgs& args, const TagFinder& finder,
                                   Console& console) {
  SeenPictures seen;
  Status fits;
  const DetectSummary summary = detect_all(find_inputs(args.sources, args.recursive), finder, console,
                                           [&](std::size_t, PictureReport& report, const Image&) {
                                             if (fits) fits = add_picture(report, seen);
                                           });
  if (!fits) return tl::unexpected(fits.error());
  if (summary.stopped) return fail(ErrorCode::InvalidArgument, "stopped");
  return seen;
}

Result<SeenPictures> from_detections(const std::string& path) {
  const auto text = read_text(path == "-" ? "/dev/stdin" : path);
  if (!text) return tl::unexpected(text.error());
  auto reports = parse_reports(*text, path);
  if (!reports) return tl::unexpected(reports.error());
  SeenPictures seen;
  for (PictureReport& report : *reports)
    if (const Status fits = add_picture(report, seen); !fits) return tl::unexpected(fits.error());
  return seen;
}

Result<SeenPictures> look(const CalibrateCameraArgs& args, const TagFinder& finder, Console& console) {
  Result<SeenPictures> seen =
      args.detections.empty() ? from_pictures(args, finder, console) : from_detections(args.detections);
  if (seen && seen->names.empty()) return fail(ErrorCode::NotFound, "no picture could be read");
  return seen;
}

Status write_files(const CalibrateCameraArgs& args, const CameraCalibration& found, std::size_t pictures) {
  if (!args.output.empty()) {
    Calibration calibration = to_calibration(found);
    calibration.provenance.insert(calibration.provenance.begin(), {"pictures", fmt::format("{}", pictures)});
    if (Status written = write_calibration(args.output, calibration); !written) return written;
  }
  if (args.camera_info.empty()) return {};
  return write_text_file(args.camera_info, to_camera_info_yaml({.name = "cam", .camera = found.camera}));
}

ExitCode calibrate(const CalibrateCameraArgs& args, Console& console) {
  const auto failed = [&](const Error& error, ExitCode code) {
    console.say(error);
    return code;
  };
  CameraCalibrationOptions options;
  if (const Status usable = args.fitting.apply(options); !usable)
    return failed(usable.error(), ExitCode::Usage);
  const Result<TagMap> target = target_of(args);
  if (args.sources.empty() == args.detections.empty())
    return failed(
        {ErrorCode::InvalidArgument, "give either pictures, or --detections with what was detected", {}, {}},
        ExitCode::Usage);
  if (!target) return failed(target.error(), args.map.empty() ? ExitCode::Usage : ExitCode::SomeFailed);
  const auto finder = args.detector.make();
  if (!finder) return failed(finder.error(), ExitCode::Usage);
  if (const Status free = args.output.empty() ? Status() : check_calibration_place(args.output); !free)
    return failed(free.error(), ExitCode::SomeFailed);
  for (const std::string& output : {args.output, args.camera_info}) {
    if (const Status writable = output.empty() ? Status() : check_output_file(output); !writable)
      return failed(writable.error(), ExitCode::SomeFailed);
  }
  const Result<SeenPictures> seen = look(args, *finder, console);
  if (!seen)
    return failed(seen.error(),
                  seen.error().message == "stopped" ? ExitCode::Interrupted : ExitCode::SomeFailed);
  const auto lens = lens_model(args.lens);  // nothing: auto
  const Result<CameraCalibration> found =
      calibrate_camera(seen->detections, *target, seen->width_px, seen->height_px, lens, options);
  if (!found) return failed(found.error(), ExitCode::SomeFailed);
  console.print(args.json ? json_line(to_json(*found, seen->names)) : to_text(*found, seen->names));
  const Status written = write_files(args, *found, seen->names.size());
  return written ? ExitCode::Ok : failed(written.error(), ExitCode::SomeFailed);
}

Run prepare_calibrate_camera(CLI::App& app) {
  const auto args = std::make_shared<CalibrateCameraArgs>(app);
  app.add_option("SOURCE", args->sources,
                 "Pictures of the board: files, folders, quoted patterns, recordings")
      ->type_name("");
  app.add_option(
         "--detections", args->detections,
         "Use this output of `waymark detect --json --covariance` instead of pictures; - is standard input")
      ->type_name("FILE");
  app.add_flag("--recursive", args->recursive, "Look for pictures in the folders inside a folder too");
  app.add_option("--cols", args->columns, "Tags in a row of the board")->type_name("INTEGER")->group("Board");
  app.add_option("--rows", args->rows, "Tags in a column of the board")->type_name("INTEGER")->group("Board");
  app.add_option("--tag-size-m", args->tag_size_m, "Side of the black square of a tag, measured on the print")
      ->type_name("NUMBER")
      ->group("Board");
  app.add_option("--spacing", args->spacing, "Gap between two tags, as a share of their size")
      ->capture_default_str()
      ->type_name("NUMBER")
      ->group("Board");
  app.add_option("--first-id", args->first_id, "Number of the lower left tag")
      ->capture_default_str()
      ->type_name("INTEGER")
      ->group("Board");
  app.add_option("--map", args->map, "Instead of a board: a map of tags whose places are known well")
      ->type_name("FILE")
      ->group("Board");
  app.add_option(
         "--lens", args->lens,
         "none, radtan4, radtan5, rational8, equidistant, or auto: the simplest that foretells pictures that "
         "were left out as well as the best")
      ->check(CLI::IsMember({"auto", "none", "radtan4", "radtan5", "rational8", "equidistant"}))
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option("-o,--output", args->output, "calibration.yaml to write")
      ->check(yaml_name())
      ->type_name("FILE");
  app.add_option("--camera-info", args->camera_info, "The camera as ROS writes it, to write")
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
