#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/base/suggest.hpp"
#include "waymark/cli/detections_json.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/log_options.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/page_files.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/robot_setup.hpp"
#include "waymark/recording/export_log.hpp"

namespace waymark::cli {
namespace {

namespace fs = std::filesystem;

struct ConvertArgs {
  std::string first;
  std::vector<std::string> rest;  ///< further inputs, then the output
  std::vector<std::string> inputs;
  std::string output;
  std::string format;
  std::vector<std::string> topics;
  std::string from;
  std::string to;
  std::string kind;
  std::string robot;
  double tag_latency_s = 0.065;
  bool json = false;
};

/// A moment of a recording: seconds after its first message, or "@…" seconds of its own clock [ns].
Result<std::uint64_t> moment(const std::string& text, std::uint64_t start_ns, const char* flag) {
  const bool absolute = text.starts_with('@');
  std::size_t used = 0;
  double seconds = 0;
  try {
    seconds = std::stod(text.substr(absolute ? 1 : 0), &used);
  } catch (const std::exception&) {
    used = 0;
  }
  constexpr double kMost = 1e10;
  const bool sound = used > 0 && used == text.size() - (absolute ? 1 : 0) && seconds >= 0 && seconds < kMost;
  if (!sound)
    return fail(ErrorCode::InvalidArgument, fmt::format("'{}' is no moment", text), {.key = flag},
                "Give seconds after the start (12.5), or of the recording's clock (@1713214583.5).");
  return (absolute ? 0 : start_ns) + static_cast<std::uint64_t>(std::llround(seconds * 1e9));
}

Result<ExportOptions> export_options(const ConvertArgs& args, MessageLog& log) {
  ExportOptions options{.kind = args.kind};
  std::vector<std::string> known;
  for (const LogChannel& channel : log.channels()) known.push_back(channel.topic);
  for (const std::string& topic : args.topics) {
    if (std::ranges::find(known, topic) == known.end())
      return fail(ErrorCode::NotFound, fmt::format("the recording has no topic '{}'", topic),
                  {.source = args.inputs.front()}, suggestion(topic, known));
    options.selection.topics.insert(topic);
  }
  const std::uint64_t start = recording_start_ns(log);
  if (!args.from.empty()) {
    const auto from = moment(args.from, start, "--from");
    if (!from) return tl::unexpected(from.error());
    options.selection.from = *from;
  }
  if (!args.to.empty()) {
    const auto to = moment(args.to, start, "--to");
    if (!to) return tl::unexpected(to.error());
    options.selection.to = *to;
  }
  const LogSelection& chosen = options.selection;
  const auto end = log.summary().end;
  if (chosen.to <= chosen.from || (end && chosen.from > *end))
    return fail(
        ErrorCode::InvalidArgument, "no time is left between --from and --to, or the recording ended before",
        {.source = args.inputs.front(), .key = "--from"}, "`waymark info` shows when it begins and ends.");
  return options;
}

/// The file is written beside its place and put there when it is whole.
struct Output {
  fs::path path;
  fs::path beside;
};

Result<Output> output_of(const ConvertArgs& args) {
  Output out{.path = args.output, .beside = fmt::format("{}.{}.part", args.output, ::getpid())};
  std::error_code ignored;
  if (fs::exists(out.path, ignored))
    return fail(ErrorCode::Unwritable, "this file exists already", {.source = args.output},
                "A recording is never overwritten: choose another name or remove it.");
  return out;
}

Result<std::string> format_of(const ConvertArgs& args) {
  const std::string name =
      args.format.empty() ? fs::path(args.output).extension().string() : "." + args.format;
  if (name == ".mcap" || name == ".tum" || name == ".csv") return name.substr(1);
  return fail(ErrorCode::InvalidArgument,
              fmt::format("no format is called '{}'", name.substr(name.empty() ? 0 : 1)),
              {.source = args.output}, "End the name in .mcap, .tum or .csv, or give --format.");
}

std::map<std::string, std::string> provenance(const ConvertArgs& args, const MessageLog& log) {
  std::vector<std::string> names;
  for (const std::string& input : args.inputs) names.push_back(fs::path(input).filename().string());
  return {{"verb", "convert"},
          {"version", WAYMARK_VERSION},
          {"source", fmt::format("{}", fmt::join(names, ", "))},
          {"source_format", log.description()}};
}

Result<ExportReport> write_out(const std::string& format, MessageLog& log, const Output& out,
                               ExportOptions& options) {
  Result<std::unique_ptr<ByteSink>> sink = create_file(out.beside);
  if (!sink) {
    sink.error().place.source = out.path.string();
    return tl::unexpected(sink.error());
  }
  Result<ExportReport> report = format == "mcap"  ? export_mcap(log, std::move(*sink), options)
                                : format == "tum" ? export_tum(log, std::move(*sink), options)
                                                  : export_csv(log, std::move(*sink), options);
  std::error_code error;
  if (report) fs::rename(out.beside, out.path, error);
  if (report && !error) return report;
  std::error_code ignored;
  fs::remove(out.beside, ignored);
  // Nobody asked for the file beside it.
  if (!report && report.error().place.source == out.beside.string()) {
    report.error().place.source = out.path.string();
    if (!report.error().hint.empty()) report.error().hint = "Free some space; nothing was written.";
  }
  if (error) return fail(ErrorCode::Unwritable, error.message(), {.source = out.path.string()});
  return report;
}

nlohmann::ordered_json conversion_json(const ConvertArgs& args, const std::string& format,
                                       const MessageLog& log, const ExportReport& report) {
  nlohmann::ordered_json problems = nlohmann::ordered_json::array();
  for (const LogProblem& problem : report.problems) {
    problems.push_back({{"kind", problem.kind == LogProblem::Kind::Damage ? "damage" : "trap"},
                        {"key", problem.key},
                        {"count", problem.count},
                        {"words", to_string(problem.error)}});
  }
  nlohmann::ordered_json inputs = args.inputs;
  return {{"input", args.inputs.size() == 1 ? inputs.front() : inputs},
          {"input_format", to_string(log.format())},
          {"output", args.output},
          {"output_format", format},
          {"messages", report.messages},
          {"topics", report.by_topic},
          {"problems", std::move(problems)}};
}

void say_problems(const std::vector<LogProblem>& problems, Console& console) {
  for (const LogProblem& problem : problems) {
    const char* kind = problem.kind == LogProblem::Kind::Damage ? "damage" : "note";
    console.say(fmt::format("{}: {}{}", kind, to_string(problem.error),
                            problem.count > 1 ? fmt::format(" ({} times)", problem.count) : ""));
  }
}

/// Tables do not say what the camera is like.
Status add_robot(const ConvertArgs& args, const std::string& format, const MessageLog& log,
                 ExportOptions& options) {
  if (args.robot.empty()) return {};
  const bool samples =
      log.format() == LogFormat::Lcm || log.format() == LogFormat::Csv || log.format() == LogFormat::Merged;
  if (format != "mcap" || !samples)
    return fail(
        ErrorCode::InvalidArgument,
        "a robot's camera is added where tables or LCM logs become MCAP; what ROS recorded passes as it is",
        {.key = "--robot"}, "Leave it out, and give it to `waymark map` or `waymark localize`.");
  RecordingSetup setup;
  std::vector<std::string> ignored;
  if (Status status = take_robot(args.robot, setup, ignored); !status) return status;
  options.camera = std::move(setup.camera);
  options.base_T_cam = setup.base_T_cam;
  return {};
}

ExitCode convert(const ConvertArgs& args, Console& console) {
  const Result<std::string> format = format_of(args);
  const Result<Output> out = format ? output_of(args) : tl::unexpected(format.error());
  if (!out) {
    console.say(out.error());
    return out.error().code == ErrorCode::InvalidArgument ? ExitCode::Usage : ExitCode::SomeFailed;
  }
  const auto latency = Duration(std::llround(args.tag_latency_s * 1e9));
  const Result<std::unique_ptr<MessageLog>> log =
      open_logs(args.inputs, until_interrupted({.mbot_tag_latency = latency}));
  if (!log) {
    console.say(log.error());
    return ExitCode::SomeFailed;
  }
  Result<ExportOptions> options = export_options(args, **log);
  if (!options) {
    console.say(options.error());
    return options.error().code == ErrorCode::InvalidArgument ? ExitCode::Usage : ExitCode::SomeFailed;
  }
  options->metadata["waymark_convert"] = provenance(args, **log);
  if (Status status = add_robot(args, *format, **log, *options); !status) {
    console.say(naming_flag(status.error()));
    return exit_code_of(status.error());
  }
  options->progress = [&](double done) -> Status {
    console.live(fmt::format("{} {:.0f} %", args.output, 100 * done));
    return interrupted() ? Status(fail(ErrorCode::Unwritable, "stopped: nothing was written")) : Status{};
  };
  const Result<ExportReport> report = write_out(*format, **log, *out, *options);
  console.end_progress();
  if (!report) {
    console.say(report.error());
    return interrupted() ? ExitCode::Interrupted : ExitCode::SomeFailed;
  }
  if (args.json) {
    console.print(json_line(conversion_json(args, *format, **log, *report)));
  } else {
    std::string text =
        fmt::format("{} ({}) to {}: {} {}\n", fmt::join(args.inputs, ", "), (*log)->description(),
                    args.output, report->messages, *format == "mcap" ? "messages" : "lines");
    for (const auto& [topic, count] : report->by_topic) text += fmt::format("  {:<32} {:>9}\n", topic, count);
    console.print(text);
    say_problems(report->problems, console);
  }
  return ExitCode::Ok;
}

Run prepare_convert(CLI::App& app) {
  const auto args = std::make_shared<ConvertArgs>();
  app.add_option("IN", args->first, "Recording: MCAP, rosbag2 (.db3, folder), ROS 1 bag, LCM event log, CSV")
      ->required()
      ->type_name("");
  app.add_option(
         "OUT", args->rest,
         "New file: .mcap, .tum or .csv. Before it further recordings of the same drive, which are merged in "
         "the order of their stamps")
      ->required()
      ->type_name("");
  app.add_option("--format", args->format, "mcap, tum or csv, whatever OUT ends in")->type_name("NAME");
  app.add_option("--topics,--topic", args->topics, "Only these topics, with commas between them")
      ->delimiter(',')
      ->type_name("A,B");
  app.add_option("--from", args->from, "Only from here [s]: after the start, or @ the recording's clock")
      ->type_name("T");
  app.add_option("--to", args->to, "Only before here [s]")->type_name("T");
  app.add_option("--kind", args->kind, "What a .csv holds: detections, odometry, imu, range-bearing")
      ->check(CLI::IsMember({"detections", "odometry", "imu", "range-bearing"}))
      ->type_name("NAME");
  app.add_option(
         "--robot", args->robot,
         "For tables and LCM logs that become .mcap: camera and where it sits, a robot's file or a name")
      ->type_name("FILE");
  app.add_option("--tag-latency-s", args->tag_latency_s,
                 "How long before its stamp an MBot's picture was taken [s] (LCM logs)")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str()
      ->type_name("S");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) {
    args->inputs = {args->first};
    args->inputs.insert(args->inputs.end(), args->rest.begin(), args->rest.end() - 1);
    args->output = args->rest.back();
    return convert(*args, console);
  };
}

}  // namespace

Verb convert_verb() {
  return {
      .name = "convert",
      .sentence = "Write a recording of any format as MCAP, TUM or CSV",
      .help =
          R"(Reads MCAP, rosbag2 (.db3 or a bag folder, split or not), ROS 1 bags, LCM event logs of an MBot and CSV tables, each
also packed with bzip2, gzip or zstd. What a file is, its content tells. Damage and traps (units, orders, stamps) are
handled and said (docs/formats/importing.md). OUT appears only when it is whole.

  .mcap   ROS 2 messages pass as they are; those of ROS 1 are rewritten; LCM and CSV become our messages
  .tum    poses of one topic: timestamp [s] tx ty tz [m] qx qy qz qw
  .csv    detections, odometry, imu or range-bearing, units in the names of the columns

Exit code: 0 written, 1 not readable or not writable, 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark convert lap.mcap path.tum --topics /odom
  waymark convert lap.mcap seen.csv --kind detections --from 2 --to 10
  waymark convert detections.csv odometry.csv imu.csv lap.mcap --robot limo
)",
      .prepare = prepare_convert,
      .verbs = {}};
}

}  // namespace waymark::cli
