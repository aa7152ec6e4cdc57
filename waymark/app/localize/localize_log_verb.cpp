#include "waymark/app/cli/localize_parts.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/app/localize/localize_log.hpp"

namespace waymark::cli {
namespace {

struct LocalizeLogArgs {
  explicit LocalizeLogArgs(CLI::App& verb) : settings(verb), method(settings) {
    add_fields(verb, job);
    verb.add_flag("--json", json, "One JSON object instead of words");
  }

  Settings settings;
  LocalizeJob job{};
  bool json = false;
  MethodFlags method;
};

ExitCode localize_log(const LocalizeLogArgs& args, Console& console) {
  LocalizeJob job = args.job;
  Status sound = args.method.apply(job.method, job.filter, job.anchor);
  if (sound) sound = check_job(job);
  if (!sound) return fail_usage(sound.error(), console);
  job.asked = [&args](RiekfOptions& filter) { return args.method.apply(filter); };
  job.no_adapt = job.no_adapt || args.method.set_filter();  // what was asked for is kept
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
      .sentence = "Estimate where a robot was, from a recording of a drive",
      .help =
          R"(Reads what the robot saw and how it moved, and writes where it was: certain estimates on the topic
/waymark/pose, mere guesses on /waymark/pose_uncertain, and for each observation of a mapped tag on /waymark/nis how
well it agreed (normalised innovation squared). Tags that contradict all others are named and not used: swapped,
moved, of another size. `waymark evaluate` compares the output with a truth.

Several recordings must be of one drive. Where the recording does not hold the robot's camera and its mounting, --robot
names the robot's file. Noise and latency are found from the recording where the assumed numbers do not fit it;
--no-adapt, or a filter's option, keeps them. What is printed at the end: how many estimates are certain, how many
observations were accepted, and where the robot was last.

Exit code: 0 the place of the robot was known at some time, 1 never, or a file was unusable, 2 wrong usage, 130 stopped
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
