#include "waymark/app/cli/localize_parts.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/app/localize/localize_log.hpp"

namespace waymark::cli {
namespace {

struct LocalizeLogArgs {
  explicit LocalizeLogArgs(CLI::App& verb) : settings(verb), method(settings) {
    add_fields(verb, job);
    verb.add_flag("--json", json, "Print one JSON object instead of text");
  }

  Settings settings;
  LocalizeJob job{};
  bool json = false;
  MethodFlags method;
};

ExitCode localize_log(const LocalizeLogArgs& args, Console& console) {
  LocalizeJob job = args.job;
  Status valid = args.method.apply(job.method, job.filter, job.anchor);
  if (valid) valid = check_job(job);
  if (!valid) return fail_usage(valid.error(), console);
  job.asked = [&args](RiekfOptions& filter) { return args.method.apply(filter); };
  job.no_adapt = job.no_adapt || args.method.set_filter();  // options set by the caller must not be adapted
  const JobControl control = control_from(console);
  Result<LocalizeInputs> inputs = read_localize_inputs(job, control);
  if (!inputs) return fail_with(inputs.error(), console);
  const Result<LocalizeReport> report = localize(job, *inputs, control);
  if (!report) return fail_with(report.error(), console);
  return show_localized(*report, args.json, inputs->warnings, console);
}

}  // namespace

Verb localize_log_verb() {
  return {
      .name = "log",
      .sentence = "Estimate the trajectory of a robot from a recording of its drive",
      .help =
          R"(Reads observations and motion, and writes poses: certain estimates on the topic /waymark/pose, uncertain ones on
/waymark/pose_uncertain. The normalised innovation squared of each map tag observation is written to /waymark/nis. Tags
that contradict the others (swapped, moved, or with a wrong size) are reported and ignored. `waymark evaluate` compares
the output with ground truth.

If several recordings are given, they must be of the same drive. If the recording does not contain the robot's camera
and its mounting, give a robot file with --robot. Noise and latency are estimated from the recording if the assumed
values do not fit it; --no-adapt or any filter option disables this. At the end the program prints the number of certain
estimates, the number of accepted observations, and the last pose.

Exit code: 0 at least one certain estimate, 1 none, or a file was unusable, 2 wrong usage, 130 stopped
by Ctrl-C (nothing is written then).

Examples:
  waymark localize lap.mcap --map map/map.yaml -o estimate.mcap
  waymark localize lap.mcap --map map --method smoother -o smooth.tum
  waymark localize lcmlog --map landmarks.csv --robot mbot --json
  waymark localize ranges.csv odometry.csv --map landmarks.csv --sensor-pose 0.219 0 0
)",
      .prepare = prepared(localize_log),
      .report = report_of<LocalizeReport>};
}

}  // namespace waymark::cli
