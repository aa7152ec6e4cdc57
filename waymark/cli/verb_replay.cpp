#include <system_error>

#include "waymark/cli/parts.hpp"
#include "waymark/cli/replay_args.hpp"
#include "waymark/jobs/route_files.hpp"

namespace waymark::cli {
namespace {

ExitCode replay(const ReplayArgs& args, Console& console) {
  if (const auto known = args.job_of(args.job); !known)  // before files are read
    return fail_usage(known.error(), console);
  if (const Status there = check_map_folder(args.folder); !there && args.setup.lacks_world())
    return console.failed(there.error(), ExitCode::SomeFailed);  // a world would not help
  const Result<RobotSetup> setup = args.make_setup();
  const Status seen = setup ? Status() : tl::unexpected(setup.error());
  ReplayJob calibrated = args.job;
  if (const Status read = take_calibration(args.calibration, calibrated); seen && !read)
    return fail_with(read.error(), console);
  Result<ReplayJob> job = seen ? args.job_of(std::move(calibrated)) : tl::unexpected(seen.error());
  if (!job) return fail_usage(job.error(), console);
  const auto view = start_page(args.live, *setup, console);
  if (!view) return fail_with(view.error(), console);
  if (*view) job->feed = &(*view)->feed();
  const auto stop = setup->process.empty() ? nullptr : listen_for_stop("replay of " + args.folder, console);
  const Result<ReplayReport> report = replay_route(*setup, *job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report, interrupted_by()));
  for (const std::string& warning : report->warnings) console.say("warning: " + warning);
  if (!succeeded(*report)) console.say(ending(*report, interrupted_by()));
  if (report->end.interrupted) return ExitCode::Interrupted;
  return succeeded(*report) ? ExitCode::Ok : ExitCode::SomeFailed;
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
      .prepare = prepared(replay)};
}

}  // namespace waymark::cli
