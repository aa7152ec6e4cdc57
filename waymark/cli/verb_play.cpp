#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>

#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/log_options.hpp"
#include "waymark/cli/selection_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/drivers/dds/open_bus.hpp"
#include "waymark/drivers/ros2/log_publisher.hpp"
#include "waymark/jobs/play_log.hpp"

namespace waymark::cli {
namespace {

struct PlayArgs {
  explicit PlayArgs(CLI::App& app) : selection(app) {}

  std::string file;
  double speed = 1;
  bool messages = false;
  bool json = false;
  bool ros2 = false;
  SelectionFlags selection;
};

Status play_to_ros2(const PlayArgs& args, MessageLog& log, const LogSelection& selection, Console& console) {
  const auto bus = open_bus();
  if (!bus) return tl::unexpected(bus.error());
  LogPublisher publisher(**bus);
  const auto publish = [&](const LogChannel& channel, const LogMessage& message) {
    return publisher.publish(channel, message);
  };
  const Status status = play_messages(log, selection, args.speed, publish, interrupted);
  for (const std::string& topic : publisher.passed_over())
    console.say(topic + " was passed over: not of ROS");
  console.print(fmt::format("{} messages published\n", publisher.published()));
  return status;
}

ExitCode play(const PlayArgs& args, Console& console) {
  if (!(args.speed >= 0 && args.speed <= 1e6)) {
    console.say(Error{ErrorCode::InvalidArgument,
                      fmt::format("{} is no speed", args.speed),
                      {.key = "--speed"},
                      "1 is as it was, 0 as fast as possible."});
    return ExitCode::Usage;
  }
  const Result<std::unique_ptr<MessageLog>> log = open_log(args.file, until_interrupted());
  if (!log) return console.failed(log.error(), ExitCode::SomeFailed);
  const Result<LogSelection> selection = args.selection.make(**log);
  if (!selection) return console.failed(selection.error(), ExitCode::Usage);
  const PlayOptions options{.speed = args.speed, .messages = args.messages, .json = args.json};
  const auto print = [&](const std::string& line) {
    console.print(line);
    return !console.output_ended();
  };
  const Status status = args.ros2 ? play_to_ros2(args, **log, *selection, console)
                                  : play_log(**log, *selection, options, print, interrupted);
  std::vector<std::string> problems;
  for (const LogProblem& problem : (*log)->problems()) problems.push_back(to_string(problem.error));
  console.say_first(problems, "`waymark info --json` gives all");
  if (interrupted()) return ExitCode::Interrupted;
  return status || console.output_ended() ? ExitCode::Ok
                                          : console.failed(status.error(), ExitCode::SomeFailed);
}

Run prepare(CLI::App& app) {
  const auto args = std::make_shared<PlayArgs>(app);
  app.add_option("FILE", args->file,
                 "Recording of any kind: MCAP, rosbag2, ROS 1 bag, LCM event log, CSV; also packed")
      ->required()
      ->type_name("");
  app.add_option("--speed", args->speed, "Playback rate: 1 as recorded, 2 twice as fast, 0 without waiting")
      ->capture_default_str()
      ->type_name("NUMBER");
  app.add_flag("--messages", args->messages,
               "All messages as they lie in the file (topic, type, size) instead of samples");
  app.add_flag(
      "--ros2", args->ros2,
      "Publish the messages on the network of ROS 2 instead of printing them (ROS_DOMAIN_ID counts)");
  app.add_flag("--json", args->json, "One JSON object a line instead of words");
  return [args](Console& console) { return play(*args, console); };
}

}  // namespace

Verb play_verb() {
  return {
      .name = "play",
      .sentence = "Print the samples of a recording at their times",
      .help =
          R"(One line a sample: when, what kind, its numbers; poses and corners of tags, odometry, wheels, IMU, scans,
commands, pictures by their size. Units are those of the house: metres, seconds, radians (degrees in words).
Keys of --json: docs/reference/cli.md.

Exit code: 0 played to the end, 1 not a recording or not readable, 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark play lap.mcap
  waymark play lap.mcap --speed 0 --from 10 --to 12 --topics /odom,/tag_detections
  waymark play lap.mcap --speed 0 --json
  waymark play lap.mcap --ros2
)",
      .prepare = prepare,
      .verbs = {}};
}

}  // namespace waymark::cli
