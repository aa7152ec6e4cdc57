#include "waymark/cli/detector_flags.hpp"
#include "waymark/cli/parts.hpp"
#include "waymark/jobs/detections_text.hpp"
#include "waymark/jobs/evaluate_detections.hpp"

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
  Status usable = args.matching.apply(job.matching);
  if (usable) usable = check_edges(job.edges);
  if (!usable) return tl::unexpected(usable.error());
  if (job.sources.empty() == job.detections.empty())
    return fail(ErrorCode::InvalidArgument,
                "give either pictures to detect in, or --detections with what was detected");
  const char* why = "with --detections nothing is detected";
  Refusals refused(args.settings.app());
  refused.flags(!job.detections.empty(), {"--recursive"}, why, "Leave it out, or give pictures.");
  refused.all(!job.detections.empty(), args.detector, why, "Leave it out, or give pictures.");
  if (!refused.status()) return tl::unexpected(refused.status().error());
  return job;
}

ExitCode evaluate(const EvaluateArgs& args, Console& console) {
  const auto job = job_of(args);
  if (!job) return console.failed(job.error(), ExitCode::Usage);
  TagFinder finder;
  if (!job->sources.empty()) {
    auto made = args.detector.make();
    if (!made) return console.failed(made.error(), ExitCode::Usage);
    finder = std::move(*made);
  }
  const auto report = evaluate_detections(*job, finder, control_from(console));
  if (!report) return console.failed(report.error(), ExitCode::SomeFailed);
  if (report->scores)
    console.print(args.json ? json_line(to_json(*report->scores)) : to_text(*report->scores));
  const bool some_failed = report->failed > 0 || report->error;
  if (report->error) console.say(*report->error);
  if (report->stopped) return ExitCode::Interrupted;
  return some_failed ? ExitCode::SomeFailed : ExitCode::Ok;
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
      .prepare = prepared(evaluate)};
}

}  // namespace waymark::cli
