#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/log_options.hpp"
#include "waymark/cli/playback_pace.hpp"
#include "waymark/cli/selection_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/sample_words.hpp"

namespace waymark::cli {
namespace {

struct PlayArgs {
  explicit PlayArgs(CLI::App& app) : selection(app) {}

  std::string file;
  double speed = 1;
  bool messages = false;
  bool json = false;
  SelectionFlags selection;
};

/// How a visit is ended from inside.
tl::unexpected<Error> enough() { return fail(ErrorCode::LimitExceeded, "stopped"); }

Status play_samples(const PlayArgs& args, MessageLog& log, const LogSelection& selection, Console& console) {
  Pace pace(args.speed);
  std::optional<SensorTime> start;
  return log.visit_samples(selection, [&](const Sample& sample) -> Status {
    if (!start) start = stamp_of(sample);
    if (!pace.wait_for(stamp_of(sample).time_since_epoch().count())) return enough();
    console.print(args.json ? json_line(to_json(sample)) : to_text(sample, *start));
    return console.output_ended() ? enough() : Status{};
  });
}

Status play_messages(const PlayArgs& args, MessageLog& log, const LogSelection& selection, Console& console) {
  Pace pace(args.speed);
  const std::uint64_t start = recording_start_ns(log);
  return log.visit(selection, [&](const LogChannel& channel, const LogMessage& message) -> Status {
    if (!pace.wait_for(static_cast<std::int64_t>(std::max(start, message.log_time)))) return enough();
    if (args.json) {
      console.print(json_line({{"topic", channel.topic},
                               {"type", channel.type},
                               {"log_time_ns", message.log_time},
                               {"publish_time_ns", message.publish_time},
                               {"size_bytes", message.data.size()}}));
    } else {
      const double since_s = static_cast<double>(static_cast<std::int64_t>(message.log_time - start)) * 1e-9;
      console.print(fmt::format("{:>10.3f}  {:<24}  {}, {} bytes\n", since_s, channel.topic, channel.type,
                                message.data.size()));
    }
    return console.output_ended() ? enough() : Status{};
  });
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
  const Status status = args.messages ? play_messages(args, **log, *selection, console)
                                      : play_samples(args, **log, *selection, console);
  for (const LogProblem& problem : (*log)->problems()) console.say(problem.error);
  if (interrupted()) return ExitCode::Interrupted;
  if (status || console.output_ended()) return ExitCode::Ok;
  console.say(status.error());
  return ExitCode::SomeFailed;
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
)",
      .prepare = prepare,
      .verbs = {}};
}

}  // namespace waymark::cli
