#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/file_names.hpp"
#include "waymark/cli/live_steps.hpp"
#include "waymark/cli/live_view.hpp"
#include "waymark/cli/loop_steps.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/page_files.hpp"
#include "waymark/cli/picture_flags.hpp"
#include "waymark/cli/stop_request.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/json_line.hpp"

namespace waymark::cli {
namespace {

struct ReplayArgs {
  explicit ReplayArgs(CLI::App& app)
      : stage(app, {}, true, "robot.yaml of the map's folder, "),
        pictures(app),
        filter(app, "Methods riekf and ekf"),
        motion(app, "Methods riekf and ekf: motion"),
        anchor(app, "Method anchor"),
        follower(app, "Controller follower"),
        actuators(app, "Controller follower: the robot's motors"),
        profile(app, "Speed"),
        pursuit(app, "Controller pursuit"),
        goal(app, "Controller pose"),
        watch(app, "Alarms"),
        consistency(app, "Alarms: sources of motion that contradict each other"),
        safety(app, "Limits") {
    add_flags(app, live);
  }

  StageFlags stage;
  LiveFlags live{};
  PictureFlags pictures;
  ReplayJob job{};
  std::string method = "riekf";
  std::string controller = "follower";
  std::string folder;
  std::string calibration;
  bool json = false;
  OptionFlags<RiekfOptions> filter;
  OptionFlags<MotionNoise> motion;
  OptionFlags<AnchorOptions> anchor;
  OptionFlags<FollowerOptions> follower;
  OptionFlags<ActuatorOptions> actuators;
  OptionFlags<ProfileOptions> profile;
  OptionFlags<PurePursuitOptions> pursuit;
  OptionFlags<GoToPoseOptions> goal;
  OptionFlags<WatchOptions> watch;
  OptionFlags<ConsistencyOptions> consistency;
  OptionFlags<SafetyOptions> safety;
};

/// Flags count more than the calibration that the job knows.
Result<ReplayJob> with_flags(const ReplayArgs& args, ReplayJob job) {
  job.folder = args.folder;
  const Result<LocalizationKind> method = parse_replay_method(args.method);
  if (!method) return tl::unexpected(method.error());
  job.method = *method;
  Result<ReplayController> controller = parse_controller(args.controller);
  if (!controller) {
    controller.error().place.key = "--controller";
    return tl::unexpected(std::move(controller.error()));
  }
  job.replay.controller = *controller;
  if (!(job.replay.laps > 0 && job.replay.laps <= 1000))
    return fail(ErrorCode::InvalidArgument, fmt::format("{} is outside (0, 1000]", job.replay.laps),
                {.key = "--laps"});
  Status status = args.anchor.apply(job.anchor);
  if (status) status = args.filter.apply(job.filter);
  if (status) status = args.motion.apply(job.filter.motion);
  if (status) status = args.follower.apply(job.replay.follower);
  if (status) status = args.actuators.apply(job.replay.actuators);
  if (status) status = args.profile.apply(job.replay.profile);
  if (status) status = args.pursuit.apply(job.replay.pursuit);
  if (status) status = args.goal.apply(job.replay.goal);
  if (status) status = args.watch.apply(job.replay.watch);
  if (status) status = args.consistency.apply(job.replay.consistency);
  if (status) status = args.safety.apply(job.replay.safety);
  if (!status) return tl::unexpected(status.error());
  return job;
}

Status check_images(const ReplayArgs& args, const Stage& stage) {
  if (args.job.images.empty()) return {};
  const Place place{.key = "--record-images"};
  if (args.job.output.empty())
    return fail(ErrorCode::InvalidArgument, "nothing is recorded", place, "Add -o FILE.");
  if (!stage.simulated.pictures && stage.process.empty())
    return fail(ErrorCode::InvalidArgument, "there are no pictures to record", place, "Add --images.");
  return {};
}

std::string to_text(const ReplayReport& report) {
  const ReplayEnd& end = report.end;
  std::string text = fmt::format("{}; {:.1f} s, {} stops\n", ending(report), end.lap_s, end.stops);
  for (const StationVisit& visit : report.visits)
    text += fmt::format("stood at '{}', {:.2f} m along the route, for {:.1f} s\n", visit.name,
                        visit.arc_length_m, visit.stood_s);
  if (end.frames > 0)
    text += fmt::format("two or more tags in view {:.1f} % of the time\n",
                        100.0 * end.frames_with_two_tags / end.frames);
  if (!report.judgement) return text;
  const ReplayJudgement& j = *report.judgement;
  return text + fmt::format(
                    "by the truth: {} laps completed, {:.2f} m driven\n"
                    "  from the taught way  {:.3f} m rmse, {:.3f} m 95 %, {:.3f} m worst\n"
                    "  heading              {:.2f} deg rmse\n"
                    "  nearest to a tag     {:.3f} m from the hull\n",
                    j.laps_completed, j.distance_m, j.cross_track_rmse_m, j.cross_track_p95_m,
                    j.cross_track_max_m, j.heading_rmse_deg, j.min_clearance_m);
}

ExitCode replay(const ReplayArgs& args, Console& console) {
  const std::filesystem::path beside = std::filesystem::path(args.folder) / "robot.yaml";
  std::error_code ignored;
  Result<Stage> stage = args.stage.make(std::filesystem::exists(beside, ignored) ? beside.string() : "");
  Status seen = stage ? args.pictures.apply(stage->simulated) : tl::unexpected(stage.error());
  if (seen) seen = check_images(args, *stage);
  ReplayJob calibrated = args.job;
  if (const Status read = take_calibration(args.calibration, calibrated); seen && !read) {
    console.say(read.error());
    return exit_code_of(read.error());
  }
  Result<ReplayJob> job = seen ? with_flags(args, calibrated) : tl::unexpected(seen.error());
  if (!job) {
    console.say(naming_flag(job.error()));
    return ExitCode::Usage;
  }
  const auto view = LiveView::start(args.live, *stage, console);
  if (!view) {
    console.say(view.error());
    return exit_code_of(view.error());
  }
  if (*view) job->feed = &(*view)->feed();
  const auto stop = stage->process.empty() ? nullptr : hear_stop("replay of " + args.folder, console);
  const Result<ReplayReport> report =
      stage->process.empty() ? replay_route(*stage, *job, console) : replay_live(*stage, *job, console);
  if (!report) {
    console.say(report.error());
    return exit_code_of(report.error());
  }
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report));
  for (const std::string& warning : report->warnings) console.say("warning: " + warning);
  if (!succeeded(*report)) console.say(ending(*report));
  if (report->end.interrupted) return ExitCode::Interrupted;
  return succeeded(*report) ? ExitCode::Ok : ExitCode::SomeFailed;
}

Run prepare_replay(CLI::App& app) {
  const auto args = std::make_shared<ReplayArgs>(app);
  app.add_option("MAP", args->folder, "Folder that `waymark map` wrote")->required()->type_name("");
  app.add_option("--method", args->method,
                 "Localisation method: riekf (right-invariant extended Kalman filter), ekf (extended Kalman "
                 "filter) or anchor (nearest tag and odometry)")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option("--controller", args->controller,
                 "Controller: follower (curvature feed-forward and error feedback), pursuit (pure pursuit) "
                 "or pose (goal to goal)")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option(
         "--route", args->job.route,
         "Name of the route to drive, of another lap (`waymark map --route-name`) or optimised (`waymark "
         "optimize`, which is judged by itself); `waymark routes` lists them. Unless given: the taught route")
      ->type_name("NAME");
  app.add_option("--calibration", args->calibration,
                 "Calibration of this robot (calibration.yaml); its yaw gain is the initial value that the "
                 "follower learns from")
      ->type_name("FILE");
  app.add_option("--laps", args->job.replay.laps, "Number of laps of a closed route")
      ->capture_default_str()
      ->type_name("NUMBER");
  app.add_option("-o,--output", args->job.output, "Recording to write of the replay (.mcap)")
      ->transform(recording_name())
      ->type_name("FILE");
  app.add_option("--record-images", args->job.images,
                 "With -o: also record the pictures (with --images, or of a robot that sends them): jpeg, or "
                 "raw, ten times as large")
      ->check(CLI::IsMember({"jpeg", "raw"}))
      ->type_name("HOW");
  app.add_flag("--durable", args->job.durable, kDurableHelp);
  app.add_option("--taught", args->job.taught,
                 "Recording of the lap to judge by. Unless given: truth_trajectory.txt of the folder")
      ->type_name("FILE");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return replay(*args, console); };
}

}  // namespace

Verb replay_verb() {
  return {
      .name = "replay",
      .sentence = "Replay a taught route autonomously",
      .help =
          R"(The robot starts where the taught lap began, looks for tags of the map, and follows the route. A limiter
has the last word before the motors: it stops the robot, and says why, when odometry or gyro are old, the
place is not known well enough, the route is far, a tag or something the lidar sees is near; it drives on when
the reason is gone, and is given up after five seconds. A robot that was carried and a clock that jumped are
stops that last. docs/concepts/replay.md explains the controllers and the limits. The judgement is by the truth alone: the base's true way against that of the teach lap.
Keys of --json: docs/reference/cli.md.

--robot process:CMD drives any robot that a program of yours speaks for (docs/formats/robot-process.md), in
real time and behind a watchdog: a process of its own that stops the robot when this one is gone or silent.

Exit code: 0 all laps were driven, 1 refused, stopped on the way, or a file was unusable (said in words),
2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark replay map --robot sim --world circuit24 --seed 11
  waymark replay map --world circuit24 --seed 12 --laps 2 -o replay.mcap --json
  waymark replay map --world circuit24 --faults faults.yaml
  waymark replay map --world circuit24 --controller pursuit --speed-m-s 0.4
  waymark replay map --robot "process:python3 my_robot.py" --robot-file my_robot.yaml
)",
      .prepare = prepare_replay,
      .verbs = {}};
}

}  // namespace waymark::cli
