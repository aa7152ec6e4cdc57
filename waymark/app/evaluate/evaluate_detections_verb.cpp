#include "waymark/app/cli/detection_flags.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/app/detect/detect_images.hpp"
#include "waymark/app/evaluate/evaluate_detections.hpp"

namespace waymark::cli {
namespace {

struct EvaluateArgs {
  explicit EvaluateArgs(CLI::App& verb)
      : settings(verb), matching(settings, "matching", "Matching"), detector(settings, kMoreGroup) {
    add_fields(verb, job);
    verb.add_flag("--json", json, "One JSON object instead of tables");
    add_option(verb, "--size-edges-px LIST", job.edges.size_px,
               "Edges of the size classes, for example 0,16,32,64", kByCommas)
        ->allow_extra_args(false);
    add_option(verb, "--tilt-edges-deg LIST", job.edges.tilt_deg,
               "Edges of the tilt classes, for example 0,30,60,90", kByCommas)
        ->allow_extra_args(false);
  }

  Settings settings;
  EvaluateDetectionsJob job{};
  bool json = false;
  OptionFlags<MatchOptions> matching;
  DetectorFlags detector;
};

Result<EvaluateDetectionsJob> job_of(const EvaluateArgs& args) {
  EvaluateDetectionsJob job = args.job;
  Refusals refused(args.settings.app());
  refused.all(!job.detections.empty(), args.detector, kNothingDetected, "Omit this option, or give images.");
  Status usable = args.matching.apply(job.matching);
  if (usable) usable = check_effects(job, given_on(args.settings.app()));
  if (usable) usable = refused.status();
  if (!usable) return tl::unexpected(usable.error());
  return job;
}

ExitCode evaluate_found(const EvaluateArgs& args, Console& console) {
  const auto job = job_of(args);
  if (!job) return fail_usage(job.error(), console);
  TagFinder finder;
  if (!job->sources.empty()) {
    auto made = args.detector.make();
    if (!made) return fail_usage(made.error(), console);
    finder = std::move(*made);
  }
  const auto report = evaluate_detections(*job, finder, control_from(console));
  if (!report) return fail_with(report.error(), console);
  if (report->scores)
    console.print(args.json ? json_line(fields(*report->scores)) : to_text(*report->scores));
  const bool some_failed = report->failed > 0 || report->error;
  if (report->error) console.note(*report->error);
  if (report->stopped) return ExitCode::Interrupted;
  return some_failed ? ExitCode::SomeFailed : ExitCode::Ok;
}

}  // namespace

Verb evaluate_detections_verb() {
  return {
      .name = "detections",
      .sentence = "Score detected tags against the true corners",
      .help =
          R"(A detection is correct if its family, id and corner order are correct and its corners are near the true
ones. The corner error is the detected position minus the true one; outward is away from the tag's centre. An image that
is not in the ground truth is assumed to contain no tag. The ground truth may omit folders and file extension (photo for
a/photo.png).

Exit code: 0 scored, 1 a file could not be read, 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark evaluate detections --truth truth.csv photograph.png
  waymark detect --json --covariance photograph.png > tags.jsonl
  waymark evaluate detections --truth truth.csv --detections tags.jsonl
)",
      .prepare = prepared(evaluate_found),
      .report = report_of<DetectionScores>};
}

}  // namespace waymark::cli
