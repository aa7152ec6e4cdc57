#include "waymark/app/calibrate_robot/calibrate_robot.hpp"
#include "waymark/app/cli/parts.hpp"

namespace waymark::cli {
namespace {

struct CalibrateRobotArgs : CalibrateRobotWords {
  explicit CalibrateRobotArgs(CLI::App& verb) : settings(verb), filter(settings, "filter", "Filter") {
    add_fields(verb, static_cast<CalibrateRobotWords&>(*this));
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
  refused.options(true, args.filter, kNoDelay, "Leave it out.", "lag_s");
  refused.fields(job.drive.map.empty() || job.by == CalibrateRobotBy::Innovations, {"--map-sigma"},
                 "this is about a map, where the method is lap", "Give --map, or leave it out.");
  Status flags = refused.status();
  if (flags) flags = args.filter.apply(job.drive.filter);
  job.drive.asked = [&args](RiekfOptions& filter) { return args.filter.apply(filter); };
  if (!flags) return tl::unexpected(flags.error());
  if (!args.filter.given()) return job;
  if (job.by == CalibrateRobotBy::Lap || job.drive.map.empty())
    return fail(ErrorCode::InvalidArgument, "flags of the filter mean nothing where no filter runs",
                {.key = "--by"}, "Leave them out, or give --by innovations and a --map.");
  job.by = CalibrateRobotBy::Innovations;  // who says how the filter is to be set means the filter
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
  if (!earlier->empty()) console.say("the earlier file is kept: " + *earlier);
  if (!job->drive.output.empty()) console.say("wrote " + job->drive.output);
  return ExitCode::Ok;
}

}  // namespace

Verb calibrate_robot_verb() {
  return {
      .name = "robot",
      .sentence = "Find where the camera sits, scales, gains and latency from a drive past tags",
      .help =
          R"(No truth is needed. Where a recording has corners of tags and odometry, tags, way and numbers are found together,
with --map from where the tags are known to be. Of other recordings (poses of tags, ranges and bearings) the numbers are
those under which the filter's predictions fit best what was seen, which needs a map. Drive at
two speeds and with turns to both sides, for at one speed a robot that slips looks like one whose camera sits elsewhere. What the drive does not tell is called unobservable, with what to drive instead of a number. Give the
result to `waymark localize --calibration`; judge it on another lap than it was made from (--from, --to).

Exit code: 0 calibrated, 1 it could not be (says why), 2 wrong usage, 130 stopped by Ctrl-C.

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
