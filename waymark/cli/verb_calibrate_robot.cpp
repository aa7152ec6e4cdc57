#include <memory>
#include <string>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/file_names.hpp"
#include "waymark/cli/frame_flags.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/cli/warnings.hpp"
#include "waymark/jobs/calibrate_robot_text.hpp"
#include "waymark/jobs/json_line.hpp"

namespace waymark::cli {
namespace {

struct CalibrateRobotArgs {
  explicit CalibrateRobotArgs(CLI::App& verb)
      : app(verb), settings(verb), filter(verb, settings, "filter", "Filter") {}

  const CLI::App& app;
  Settings settings;
  CalibrateRobotJob job{};
  std::string by;
  bool json = false;
  OptionFlags<RiekfOptions> filter;
};

Result<CalibrateRobotJob> job_of(const CalibrateRobotArgs& args) {
  CalibrateRobotJob job = args.job;
  if (args.by == "lap") job.by = CalibrateRobotBy::Lap;
  if (args.by == "innovations") job.by = CalibrateRobotBy::Innovations;
  Status flags =
      refuse(args.filter, "only the smoother of `waymark localize` has a delay", "Leave it out.", "lag_s");
  if (flags && (job.drive.map.empty() || job.by == CalibrateRobotBy::Innovations))
    flags = refuse_flag(args.app, "--map-sigma", "this is about a map, where the method is lap",
                        "Give --map, or leave it out.");
  if (flags) flags = args.filter.apply(job.drive.filter);
  if (!flags) return tl::unexpected(flags.error());
  if (!args.filter.given()) return job;
  if (job.by == CalibrateRobotBy::Lap || job.drive.map.empty())
    return fail(ErrorCode::InvalidArgument, "flags of the filter mean nothing where no filter runs",
                {.key = "--by"}, "Leave them out, or give --by innovations and a --map.");
  job.by = CalibrateRobotBy::Innovations;  // who says how the filter is to be set means the filter
  return job;
}

ExitCode calibrate(const CalibrateRobotArgs& args, Console& console) {
  const Result<CalibrateRobotJob> job = job_of(args);
  if (!job) return fail_usage(job.error(), console);
  const Result<CalibrateRobotReport> report = calibrate_robot(*job, control_from(console));
  if (!report)
    return console.failed(report.error(),
                          interrupted() ? ExitCode::Interrupted : exit_code_of(report.error()));
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report));
  say_warnings(report->warnings, console);
  if (const Status written = write_robot_calibration(*job, *report); !written)
    return console.failed(written.error(), ExitCode::SomeFailed);
  if (!job->drive.output.empty()) console.say("wrote " + job->drive.output);
  return ExitCode::Ok;
}

Run prepare_calibrate_robot(CLI::App& app) {
  const auto args = std::make_shared<CalibrateRobotArgs>(app);
  LocalizeJob& job = args->job.drive;
  app.add_option("LOG", job.logs, "Recordings of one drive past tags")->required()->type_name("");
  app.add_option("--map", job.map,
                 "Map of the tags, as for `waymark localize`. Unless given: the tags are mapped together "
                 "with the calibration")
      ->type_name("FILE");
  app.add_option("--by", args->by,
                 "Calibration method: lap (bundle adjustment of tags, trajectory and calibration, with the "
                 "map's covariance) or innovations (likelihood of the filter's innovations). Unless given: "
                 "lap where there are corners of tags and odometry, and no map or one of Waymark")
      ->check(CLI::IsMember({"lap", "innovations"}))
      ->type_name("HOW");
  add_frame_flags(app, job.frames);
  app.add_option("--robot", job.robot, "Camera and its mounting, as far as known: a robot's file, or a name")
      ->type_name("FILE");
  app.add_option("--calibration", job.calibration,
                 "Calibration known beforehand (calibration.yaml), such as the camera's")
      ->type_name("FILE");
  app.add_option("--tag-size-m", job.tag_size_m, "Tag size where the map has none")->type_name("NUMBER");
  app.add_option(
         "--map-sigma", job.map_sigma_m,
         "Standard deviation of the tags' positions, by lap, of a map without covariances, such as one "
         "measured by hand [m]")
      ->capture_default_str()
      ->check(CLI::Range(1e-6, 10.0))
      ->type_name("NUMBER");
  app.add_option("--sensor-pose", job.sensor_pose,
                 "Mounting of the range sensor on the robot: x y [m], yaw [deg]")
      ->expected(3)
      ->type_name("NUMBER");
  app.add_option("--from", args->job.from_s, "Begin of the used interval, in seconds from the start")
      ->type_name("S");
  app.add_option("--to", args->job.to_s, "End of the used interval, in seconds from the start")
      ->type_name("S");
  app.add_option("-o,--output", job.output, "Calibration to write (calibration.yaml)")
      ->check(yaml_name())
      ->type_name("FILE");
  app.add_flag("--json", args->json, "One JSON object instead of a table");
  return [args](Console& console) { return calibrate(*args, console); };
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
      .prepare = prepare_calibrate_robot,
      .verbs = {}};
}

}  // namespace waymark::cli
