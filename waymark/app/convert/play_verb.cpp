#include <fmt/format.h>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/convert/play_log.hpp"
#include "waymark/app/convert/play_to_ros2.hpp"

namespace waymark::cli {
namespace {

struct PlayArgs : PlayRequest {
  explicit PlayArgs(CLI::App& verb) : app(verb) { add_fields(verb, static_cast<PlayRequest&>(*this)); }

  const CLI::App& app;
};

Status publish(const PlayArgs& args, MessageLog& log, const LogSelection& selection, Console& console) {
  const Ros2Played played = play_to_ros2(
      log, selection, {.speed = args.options.speed, .commands = args.commands}, control_from(console));
  if (played.status || played.published > 0)
    console.print(fmt::format("{} messages published\n", played.published));
  return played.status;
}

ExitCode play(const PlayArgs& args, Console& console) {
  if (Status status = check_effects(args, given_on(args.app)); !status)
    return fail_usage(status.error(), console);
  const Result<std::unique_ptr<MessageLog>> log = open_recording(args.file, control_from(console));
  if (!log) return fail_with(log.error(), console);
  const Result<LogSelection> selection = select_part(**log, args.part);
  if (!selection) return fail_usage(selection.error(), console);
  const auto print = [&](const std::string& line) {
    console.print(line);
    return !console.output_ended();
  };
  const Status status = args.ros2 ? publish(args, **log, *selection, console)
                                  : play_log(**log, *selection, args.options, print, interrupted);
  std::vector<std::string> problems;
  bool damaged = false;
  for (const LogProblem& problem : (*log)->problems()) {
    problems.push_back(to_string(problem.error));
    damaged = damaged || problem.kind == LogProblem::Kind::Damage;
  }
  console.note_first(problems, "`waymark info --json` gives all");
  if (interrupted()) return ExitCode::Interrupted;
  if (!status && !console.output_ended()) return fail_with(status.error(), console);
  return damaged ? ExitCode::SomeFailed : ExitCode::Ok;
}

}  // namespace

Verb play_verb() {
  return {
      .name = "play",
      .sentence = "Print the samples of a recording in real time",
      .help =
          R"(Prints one line per sample with time, kind and values: tag poses and corners, odometry, wheels, IMU, scans, commands,
and image sizes. Units are metres, seconds and radians (degrees in text).
With --ros2, velocity commands (Twist, TwistStamped) are published only if --commands is given. After the last one, a
zero command is sent; a second process sends it even if this one is killed. Commands are sent as the type with a
subscriber. The verb fails if another program publishes one of the topics.

Exit code: 0 played to the end, 1 not a recording, unreadable, or damaged (intact parts are played), 2 wrong usage,
130 stopped by Ctrl-C.

Examples:
  waymark play lap.mcap
  waymark play lap.mcap --speed 0 --from 10 --to 12 --topics /odom,/tag_detections
  waymark play lap.mcap --speed 0 --json
  waymark play lap.mcap --ros2
)",
      .prepare = prepared(play),
      .report =
          report_of_any<TagFrame, TagPoseFrame, CameraFrame, Odometry, WheelTicks, ImuSample, StampedCommand,
                        TruthPose, RangeBearing, LaserScan, GamepadState, PlayedMessage>};
}

}  // namespace waymark::cli
