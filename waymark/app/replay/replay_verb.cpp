#include <utility>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/replay_flags.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/app/common/route_files.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/replay/replay_route.hpp"

namespace waymark::cli {
namespace {

struct ReplayArgs : ReplayRequest {
  explicit ReplayArgs(CLI::App& verb)
      : settings(verb),
        setup(verb, {}, true, "robot.yaml of the map's folder, "),
        images(settings, Reach::SettingsOnly),
        options(settings, Reach::Flags) {
    add_fields(verb, live);
    add_fields(verb, static_cast<ReplayRequest&>(*this));
    verb.get_option("--output")->transform(recording_name());
    verb.add_flag("--json", json, "Print one JSON object instead of text");
  }

  Settings settings;
  SetupFlags setup;
  ViewerOptions live{};
  ImageFlags images;
  ReplayFlags options;
  bool json = false;
};

/// The robot in its world. Fails if flags are set that have no effect.
Result<RobotSetup> make_setup(const ReplayArgs& args) {
  Result<RobotSetup> made = args.images.apply(args.setup.make(robot_file_in(args.job.folder)));
  if (!made) return made;
  Refusals refused(args.settings.app());
  refuse_seed(!made->process.empty(), refused);
  refused.fields(args.job.output.empty(), {"durable"}, "has no effect without a recording",
                 "Add `output=FILE`, or omit `durable`.");
  const Status status = refused.status() ? check_recording(args.job, *made) : refused.status();
  if (!status) return tl::unexpected(status.error());
  return made;
}

/// The job with its calibration applied, and then the options set by the user.
Result<ReplayJob> job_of(const ReplayArgs& args, ReplayJob calibrated) {
  Status status = choose_replay(args.method, args.controller, calibrated);
  if (status) status = args.options.apply(calibrated);
  if (!status) return tl::unexpected(status.error());
  return calibrated;
}

ExitCode replay(const ReplayArgs& args, Console& console) {
  if (const auto usable = job_of(args, args.job); !usable)  // report errors before files are read
    return fail_usage(usable.error(), console);
  if (const Status valid = check_map_folder(args.job.folder); !valid && args.setup.lacks_world())
    return console.failed(valid.error(), ExitCode::SomeFailed);  // check this before asking for a world
  const Result<RobotSetup> setup = make_setup(args);
  if (!setup) return fail_usage(setup.error(), console);
  ReplayJob calibrated = args.job;
  if (const Status read = take_calibration(args.calibration, calibrated); !read)
    return fail_with(read.error(), console);
  Result<ReplayJob> job = job_of(args, std::move(calibrated));
  if (!job) return fail_usage(job.error(), console);
  const auto view = LivePage::open(args.live, *setup, control_from(console));
  if (!view) return fail_with(view.error(), console);
  if (*view) job->feed = &(*view)->feed();
  const auto stop =
      setup->process.empty() ? nullptr : listen_for_stop("replay of " + args.job.folder.string(), console);
  const Result<ReplayReport> report = replay_route(*setup, *job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report, interrupted_by()));
  for (const std::string& warning : report->warnings) console.note("warning: " + warning);
  if (!succeeded(*report)) console.note(ending(*report, interrupted_by()));
  if (report->end.interrupted) return ExitCode::Interrupted;
  return succeeded(*report) ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb replay_verb() {
  return {
      .name = "replay",
      .sentence = "Replay a taught route autonomously",
      .help =
          R"(The robot starts where the taught lap began, searches for map tags, and follows the route. A limiter checks each
command. It stops the robot if odometry or gyro data are old, the position is uncertain, or the robot is too far
from the route. It also stops if a tag or an obstacle is too close. It prints the reason. The robot resumes when
the cause is gone; after five seconds the replay is aborted. A robot moved by hand or a clock jump ends the
replay.
docs/concepts/replay.md explains the controllers and the limits. Errors of the base's path relative to the teach lap
are reported only with ground truth.

--robot process:CMD drives any robot with a driver program (docs/formats/robot-process.md), in real time. A
watchdog in another process stops the robot if this one ends or does not respond.
Exit code: 0 all laps were driven, 1 refused, stopped early, or a file was unusable (the reason is printed),
2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark replay map --robot sim --world circuit24 --seed 11
  waymark replay map --world circuit24 --seed 12 --laps 2 -o replay.mcap --json
  waymark replay map --world circuit24 --faults faults.yaml
  waymark replay map --world circuit24 --controller pursuit --speed-m-s 0.4
  waymark replay map --robot "process:python3 my_robot.py" --robot-file my_robot.yaml
)",
      .prepare = prepared(replay),
      .report = report_of<ReplayReport>};
}

}  // namespace waymark::cli
