#include "waymark/app/cli/parts.hpp"
#include "waymark/app/evaluate/evaluate_trajectory.hpp"

namespace waymark::cli {
namespace {

struct TrajectoryArgs {
  explicit TrajectoryArgs(CLI::App& verb) : settings(verb), scoring(settings, "scoring", "Scoring") {
    add_fields(verb, job);
    verb.add_flag("--json", json, "One JSON object instead of a table");
  }

  Settings settings;
  EvaluateTrajectoryJob job{};
  bool json = false;
  OptionFlags<TrajectoryScoreOptions> scoring;
};

ExitCode evaluate(const TrajectoryArgs& args, Console& console) {
  EvaluateTrajectoryJob job = args.job;
  if (job.estimate.empty() || job.reference.empty()) {
    console.note("give two files, EST and REF, or the verb 'detections'. See `waymark evaluate --help`.");
    return ExitCode::Usage;
  }
  const GivenFields given = given_on(args.settings.app());
  Status usable = check_effects(job, nullptr, given);
  if (usable) usable = args.scoring.apply(job.scoring);
  if (!usable) return fail_usage(usable.error(), console);
  const JobControl control = control_from(console);
  const Result<EvaluationInputs> inputs = read_evaluation(job, control);
  if (!inputs) return fail_with(inputs.error(), console);
  if (usable = check_effects(job, &inputs->reference, given); !usable)
    return fail_usage(usable.error(), console);
  const Result<TrajectoryReport> report = evaluate_trajectory(job, *inputs, control);
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report));
  for (const std::string& warning : comparison_warnings(*report, inputs->reference, control))
    console.note("warning: " + warning);
  if (job.figures.empty()) return ExitCode::Ok;
  const auto files = write_evaluation_figures(*inputs, *report, job.figures);
  if (!files) return fail_with(files.error(), console);
  for (const std::string& file : *files) console.note("wrote " + file);
  return ExitCode::Ok;
}

}  // namespace

Verb evaluate_verb() {
  return {
      .name = "evaluate",
      .sentence = "Compare an estimate with the ground truth",
      .help =
          R"(Compares a trajectory (EST) with ground truth (REF) at the same times, by interpolating REF, and in REF's frame. ATE is
the distance, and RPE is the error of a motion over --rpe-delta-s seconds, both as defined by evo. "path" is the
distance from the path of REF, regardless of time. "side" is the signed distance from the part of REF with the same
direction as the robot. NEES tests whether the covariance of the estimate is consistent: its mean is then 3, and larger
if the covariance is overconfident. NIS (for recordings written by `waymark localize`) tests the observations: its mean
should be 1. Estimates marked uncertain are counted but not evaluated.

Exit code: 0 compared, 1 a file could not be read or compared, 2 wrong usage.

Examples:
  waymark evaluate replay.mcap replay.mcap
  waymark evaluate map/trajectory.txt map/truth_trajectory.txt --figures figures
  waymark evaluate detections --truth truth.csv photograph.png
)",
      .prepare = prepared(evaluate),
      .report = report_of<TrajectoryReport>,
      .verbs = {evaluate_detections_verb()}};
}

}  // namespace waymark::cli
