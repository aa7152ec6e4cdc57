#include "waymark/app/calibrate_robot/calibrate_robot.hpp"
#include "waymark/app/cli/parts.hpp"

namespace waymark::cli {
namespace {

struct CalibrateRobotArgs : CalibrateRobotRequest {
  explicit CalibrateRobotArgs(CLI::App& verb) : settings(verb), filter(settings, "filter", "Filter") {
    add_fields(verb, static_cast<CalibrateRobotRequest&>(*this));
    verb.get_option("--output")->check(yaml_name());
    verb.add_flag("--json", json, "One JSON object instead of a table");
  }

  Settings settings;
  bool json = false;
  OptionFlags<RiekfOptions> filter;
};

Result<CalibrateRobotJob> job_of(const CalibrateRobotArgs& args) {
  CalibrateRobotJob job = args.job;
  if (args.by == "lap") job.by = CalibrateRobotBy::Lap;
  if (args.by == "innovations") job.by = CalibrateRobotBy::Innovations;
  Refusals refused(args.settings.app());
  refused.options(true, args.filter, kNoDelay, "Omit this option.", "lag_s");
  refused.fields(job.drive.map.empty() || job.by == CalibrateRobotBy::Innovations, {"map_sigma"},
                 "applies only to method lap with a map", "Set `map` and `by=lap`, or omit `map_sigma`.");
  Status flags = refused.status();
  if (flags) flags = args.filter.apply(job.drive.filter);
  job.drive.asked = [&args](RiekfOptions& filter) { return args.filter.apply(filter); };
  if (!flags) return tl::unexpected(flags.error());
  if (!args.filter.given()) return job;
  if (job.by == CalibrateRobotBy::Lap || job.drive.map.empty())
    return fail(ErrorCode::InvalidArgument, "filter options have no effect on method lap", {.key = "by"},
                "Omit them, or set `by=innovations` and `map`.");
  job.by = CalibrateRobotBy::Innovations;  // filter options imply this method
  return job;
}

ExitCode calibrate_drive(const CalibrateRobotArgs& args, Console& console) {
  const Result<CalibrateRobotJob> job = job_of(args);
  if (!job) return fail_usage(job.error(), console);
  const Result<CalibrateRobotReport> report = calibrate_robot(*job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report));
  console.warn(report->warnings);
  const auto earlier = write_robot_calibration(*job, *report);
  if (!earlier) return fail_with(earlier.error(), console);
  if (!earlier->empty()) console.note("the existing file was renamed to " + *earlier);
  if (!job->drive.output.empty()) console.note("wrote " + job->drive.output);
  return ExitCode::Ok;
}

}  // namespace

Verb calibrate_robot_verb() {
  return {
      .name = "robot",
      .sentence = "Estimate camera mounting, scales, gains and latency from a drive past tags",
      .help =
          R"(No ground truth is needed. If a recording has tag corners and odometry, tags, trajectory and parameters are estimated
jointly; with --map, they are constrained by the given tag poses and covariances. For other recordings (tag poses,
ranges and bearings), the parameters are chosen to minimise the filter's innovations, which requires a map. Drive at two
speeds and turn in both directions, because at a single speed slip cannot be distinguished from a displaced camera. A
parameter that the drive does not determine is reported as unobservable, with advice on how to drive.

Pass the result to `waymark localize --calibration`. Evaluate it on a different lap from the one it was made from, or on
a different interval (--from, --to).

Exit code: 0 calibrated, 1 failed (prints the reason), 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark teach --world circuit24 --speed-m-s 0.3 --second-speed-m-s 1 --wander-m 0.3 --wander-time-s 1.5 --overlap-m 16 -o lap.mcap
  waymark calibrate robot lap.mcap -o calibration.yaml
  waymark calibrate robot lap.mcap --map map/map.yaml -o calibration.yaml
  waymark localize lap.mcap --map map/map.yaml --calibration calibration.yaml
)",
      .prepare = prepared(calibrate_drive),
      .report = report_of<CalibrateRobotReport>};
}

}  // namespace waymark::cli
