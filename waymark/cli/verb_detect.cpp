#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/annotation_names.hpp"
#include "waymark/cli/detect_all.hpp"
#include "waymark/cli/detections_text.hpp"
#include "waymark/cli/detector_flags.hpp"
#include "waymark/cli/pose_flags.hpp"
#include "waymark/cli/poses.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/plot/annotate.hpp"

namespace waymark::cli {
namespace {

namespace fs = std::filesystem;

struct DetectArgs {
  explicit DetectArgs(CLI::App& app) : detector(app), poses(app) {}

  std::vector<std::string> sources;
  bool recursive = false;
  bool json = false;
  bool covariance = false;
  std::string annotate_folder;
  DetectorFlags detector;
  PoseFlags poses;
};

/// Where annotated pictures go, once that is known to work.
struct Annotations {
  fs::path folder;  ///< empty when there are none
  std::vector<std::string> names;
  bool failed = false;  ///< wanted, but the folder cannot be made
};

/// Makes the folder. Refuses one that holds pictures to be read: annotations must not overwrite what they
/// were made from.
Result<Annotations> prepare_annotations(const std::string& folder, const std::vector<Input>& inputs,
                                        Console& console) {
  Annotations annotations;
  if (folder.empty()) return annotations;
  std::vector<std::string> paths;
  for (const Input& input : inputs) {
    paths.push_back(input.path);
    const fs::path parent = fs::path(input.path).parent_path();
    std::error_code ignored;
    if (!input.error && fs::equivalent(parent.empty() ? "." : parent, folder, ignored)) {
      return fail(
          ErrorCode::InvalidArgument, "this folder holds the pictures themselves", {.source = folder},
          "Give --annotate another folder, for example " + (fs::path(folder) / "annotated").string() + ".");
    }
  }
  annotations.names = annotation_names(paths);
  std::error_code error;
  fs::create_directories(folder, error);
  annotations.failed = error || !fs::is_directory(folder, error);
  if (!annotations.failed) annotations.folder = folder;
  if (annotations.failed) {
    const std::string why = error ? error.message() : "is not a folder";
    console.say(Error{ErrorCode::Unwritable,
                      "cannot make the folder for annotated pictures: " + why,
                      {.source = folder},
                      "Tags are reported, but no pictures written."});
  }
  return annotations;
}

Status write_annotated(const fs::path& to, const Image& image, const std::vector<TagDetection>& detections,
                       const std::vector<plot::FrameAxes>& axes) {
  const auto drawn = plot::annotate(image, detections, axes);
  if (!drawn) return tl::unexpected(drawn.error());
  return write_image(to, *drawn);
}

/// The name of a picture's own; of a recording's, its stamp behind that of the file: "lap_12.345000000.png".
std::string annotation_name(const std::string& name, const PictureReport& report, const Input& input) {
  if (report.image == input.path) return name;
  const std::size_t stamp = report.image.rfind('#');
  return fmt::format("{}_{}.png", fs::path(name).stem().string(), report.image.substr(stamp + 1));
}

/// The poses of a picture's tags. A calibration of another picture size gives none, and an error in the
/// report.
PoseList poses_for(PictureReport& report, const PoseSetup& setup) {
  if (report.width_px == 0) return {};
  if (const Status fits = check_camera_matches_image(setup.camera, report.width_px, report.height_px);
      !fits) {
    if (!report.error) report.error = fits.error();
    return {};
  }
  return poses_of(report.detections, setup);
}

ExitCode detect(const DetectArgs& args, Console& console) {
  const auto finder = args.detector.make();
  if (!finder) {
    console.say(finder.error());
    return ExitCode::Usage;
  }
  const auto setup = args.poses.make();
  if (!setup) {
    console.say(setup.error());
    return ExitCode::Usage;
  }
  const std::vector<Input> inputs = find_inputs(args.sources, args.recursive);
  const auto annotations = prepare_annotations(args.annotate_folder, inputs, console);
  if (!annotations) {
    console.say(annotations.error());
    return ExitCode::Usage;
  }
  const auto each = [&](std::size_t i, PictureReport& report, const Image& image) {
    const PoseList poses = *setup ? poses_for(report, **setup) : PoseList();
    if (!annotations->folder.empty() && report.detected) {
      const auto axes = *setup ? axes_of(report.detections, poses, **setup) : std::vector<plot::FrameAxes>();
      const auto written =
          write_annotated(annotations->folder / annotation_name(annotations->names[i], report, inputs[i]),
                          image, report.detections, axes);
      if (!written && !report.error) report.error = written.error();
    }
    if (args.json) {
      auto line = to_json(report, args.covariance);
      for (std::size_t k = 0; k < poses.size(); ++k) add_to_json(line["detections"][k], poses[k]);
      console.print(json_line(line));
    } else if (report.detected) {
      console.print(to_text(report) + to_text(report.detections, poses));
    }
  };
  const DetectSummary summary = detect_all(inputs, *finder, console, each);
  console.say(fmt::format("{} pictures, {} tags, {} failed", summary.pictures, summary.tags, summary.failed));
  const ExitCode code = summary.exit_code();
  return annotations->failed && code == ExitCode::Ok ? ExitCode::SomeFailed : code;
}

Run prepare_detect(CLI::App& app) {
  const auto args = std::make_shared<DetectArgs>(app);
  app.add_option(
         "SOURCE", args->sources,
         "Pictures (JPEG, PNG, PNM), folders of pictures, recordings with pictures, or quoted patterns "
         "such as 'lap/*.png'")
      ->required()
      ->type_name("");
  app.add_flag("--recursive", args->recursive, "Look for pictures in the folders inside a folder too");
  app.add_flag("--json", args->json, "One JSON object a line for each picture instead of tables");
  app.add_flag("--covariance", args->covariance,
               "With --json: the 8 x 8 covariance of the corners of each tag as well");
  app.add_option("--annotate", args->annotate_folder,
                 "Write each picture with its tags drawn in to this folder, as PNG: x axis red, y axis "
                 "green, dot on the "
                 "first corner")
      ->type_name("FOLDER");
  return [args](Console& console) { return detect(*args, console); };
}

}  // namespace

Verb detect_verb() {
  return {
      .name = "detect",
      .sentence = "Find tags in pictures, with sub-pixel corners",
      .help =
          R"(Results go to standard output, words and progress to standard error. Corners are those where the
black border meets the white one: top left, top right, bottom right, bottom left of the printed tag.
Pixel (i, j) covers [i, i+1) x [j, j+1). A folder's pictures are taken in the order of their names.
Pictures of a recording are called after their stamp: lap.mcap#12.345000000.
Keys of --json: docs/reference/cli.md.

Exit code: 0 all inputs processed (with or without tags), 1 some failed (the others are processed),
2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark detect photograph.png
  waymark detect --annotate seen --family tag36h11 --family tag16h5 'photos/*.png'
  waymark detect --json photos/ > tags.jsonl
  waymark detect --camera camera.yaml --tag-size-m 0.16 photograph.png

With --camera and --tag-size-m each tag gets its pose in the camera (x right, y down, z forward) with standard
deviations. A tag seen nearly from the front has two poses that fit almost equally: both are printed, the better
first, and the ratio of their errors says how sure that is (near 1: not at all).
)",
      .prepare = prepare_detect,
      .verbs = {}};
}

}  // namespace waymark::cli
