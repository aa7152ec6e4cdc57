#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/detect_all.hpp"
#include "waymark/cli/detections_text.hpp"
#include "waymark/cli/detector_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/evaluation/detections.hpp"

namespace waymark::cli {
namespace {

struct EvaluateArgs {
  explicit EvaluateArgs(CLI::App& app) : matching(app, "Matching"), detector(app) {}

  std::string truth_path;
  std::string detections_path;
  std::vector<std::string> sources;
  bool recursive = false;
  bool json = false;
  ClassEdges edges;
  OptionFlags<MatchOptions> matching;
  DetectorFlags detector;
};

/// What was detected, and whether all of it could be.
struct Reports {
  std::vector<PictureReport> reports;
  ExitCode code = ExitCode::Ok;
};

Reports run_detector(const EvaluateArgs& args, Console& console) {
  const auto finder = args.detector.make();
  if (!finder) {
    console.say(finder.error());
    return {{}, ExitCode::Usage};
  }
  Reports all;
  const auto inputs = find_inputs(args.sources, args.recursive);
  const DetectSummary summary =
      detect_all(inputs, *finder, console,
                 [&](std::size_t, PictureReport& report, const Image&) { all.reports.push_back(report); });
  all.code = summary.exit_code();
  return all;
}

Reports read_reports(const EvaluateArgs& args, Console& console) {
  const std::string path = args.detections_path == "-" ? "/dev/stdin" : args.detections_path;
  const auto text = read_text(path);
  auto reports = text ? parse_reports(*text, args.detections_path) : tl::unexpected(text.error());
  if (reports) return {std::move(*reports), ExitCode::Ok};
  console.say(reports.error());
  return {{}, ExitCode::SomeFailed};
}

/// The pictures to score, each with its truth. Says what is left out and why.
Result<std::vector<ImageDetections>> join(std::vector<PictureReport> reports, const DetectionTruth& truth,
                                          Console& console) {
  std::vector<ImageDetections> images;
  std::map<std::string, std::string> seen;  // name in the truth, path
  std::size_t without_truth = 0;
  for (PictureReport& report : reports) {
    if (report.error) continue;
    const auto name = find_image(truth, report.image);
    if (!name) ++without_truth;
    if (name && !seen.emplace(*name, report.image).second) {
      return fail(ErrorCode::InvalidArgument,
                  fmt::format("'{}' and '{}' are both '{}' of the truth", seen[*name], report.image, *name),
                  {}, "Name the folder in the truth's image column too.");
    }
    images.push_back({std::move(report.detections), name ? truth.at(*name) : std::vector<TrueTag>()});
  }
  if (seen.empty()) {
    return fail(ErrorCode::NotFound, "none of the pictures is in the truth", {},
                truth.empty() ? "The truth has no rows."
                              : fmt::format("The truth names '{}', for example.", truth.begin()->first));
  }
  if (without_truth > 0) {
    console.say(fmt::format("{} pictures are not in the truth: taken as holding no tag", without_truth));
  }
  if (seen.size() < truth.size()) {
    console.say(fmt::format("{} pictures of the truth were not given: left out", truth.size() - seen.size()));
  }
  return images;
}

ExitCode score(const EvaluateArgs& args, Reports reports, const DetectionTruth& truth,
               const MatchOptions& options, Console& console) {
  const auto failed = std::count_if(reports.reports.begin(), reports.reports.end(),
                                    [](const PictureReport& report) { return report.error.has_value(); });
  if (failed > 0) console.say(fmt::format("{} pictures failed: left out", failed));
  const auto images = join(std::move(reports.reports), truth, console);
  if (!images) {
    console.say(images.error());
    return reports.code == ExitCode::Ok ? ExitCode::SomeFailed : reports.code;
  }
  const DetectionScores scores = score_detections(*images, options, args.edges);
  console.print(args.json ? json_line(to_json(scores)) : to_text(scores));
  return failed > 0 && reports.code == ExitCode::Ok ? ExitCode::SomeFailed : reports.code;
}

ExitCode evaluate(const EvaluateArgs& args, Console& console) {
  MatchOptions options;
  Status usable = args.matching.apply(options);
  if (usable) usable = check_edges(args.edges);
  if (usable && args.sources.empty() == args.detections_path.empty()) {
    usable = fail(ErrorCode::InvalidArgument,
                  "give either pictures to detect in, or --detections with what was detected");
  }
  if (!usable) {
    console.say(usable.error());
    return ExitCode::Usage;
  }
  const auto text = read_text(args.truth_path);
  const auto truth = text ? parse_truth(*text, args.truth_path) : tl::unexpected(text.error());
  if (!truth) {
    console.say(truth.error());
    return ExitCode::SomeFailed;
  }
  Reports reports = args.sources.empty() ? read_reports(args, console) : run_detector(args, console);
  if (reports.reports.empty() && reports.code != ExitCode::Ok) return reports.code;
  return score(args, std::move(reports), *truth, options, console);
}

Run prepare_detections(CLI::App& app) {
  const auto args = std::make_shared<EvaluateArgs>(app);
  app.add_option("SOURCE", args->sources, "Pictures to detect in: files, folders, or quoted patterns")
      ->type_name("");
  app.add_option("--truth", args->truth_path,
                 "CSV with the columns image, id, x0, y0, x1, y1, x2, y2, x3, y3 and, where known, size_px, "
                 "tilt_deg, family")
      ->required()
      ->type_name("FILE");
  app.add_option(
         "--detections", args->detections_path,
         "Score this output of `waymark detect --json` instead of running the detector; - is standard input")
      ->type_name("FILE");
  app.add_flag("--recursive", args->recursive, "Look for pictures in the folders inside a folder too");
  app.add_flag("--json", args->json, "One JSON object instead of tables");
  app.add_option("--size-edges-px", args->edges.size_px, "Edges of the size classes, for example 0,16,32,64")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("LIST");
  app.add_option("--tilt-edges-deg", args->edges.tilt_deg,
                 "Edges of the tilt classes, for example 0,30,60,90")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("LIST");
  return [args](Console& console) { return evaluate(*args, console); };
}

}  // namespace

Verb evaluate_detections_verb() {
  return {
      .name = "detections",
      .sentence = "Score detected tags against the true corners",
      .help =
          R"(A detection is correct when family, id and corner order are right and its corners lie near the true
ones. Corner error = detected - true; outward is away from the tag's centre. A picture that is not in
the truth counts as holding no tag; the truth may leave out folders and suffix (photo for a/photo.png).

Exit code: 0 scored, 1 something could not be read, 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark evaluate detections --truth truth.csv photograph.png
  waymark detect --json --covariance photograph.png > tags.jsonl
  waymark evaluate detections --truth truth.csv --detections tags.jsonl
)",
      .prepare = prepare_detections,
      .verbs = {}};
}

}  // namespace waymark::cli
