#include "waymark/app/convert/convert_log.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// Converts a time in a recording to nanoseconds. It is given in seconds after the first message or, with a
/// leading "@", in seconds on the recording's clock.
Result<std::uint64_t> moment(const std::string& text, std::uint64_t start_ns, const char* field) {
  const bool absolute = text.starts_with('@');
  std::size_t used = 0;
  double seconds = 0;
  try {
    seconds = std::stod(text.substr(absolute ? 1 : 0), &used);
  } catch (const std::exception&) {
    used = 0;
  }
  constexpr double kMax_s = 1e10;
  const bool valid = used > 0 && used == text.size() - (absolute ? 1 : 0) && seconds >= 0 && seconds < kMax_s;
  if (!valid)
    return fail(ErrorCode::InvalidArgument, fmt::format("invalid time '{}'", text), {.key = field},
                "Give seconds after the start (12.5), or seconds on the recording's clock (@1713214583.5).");
  return (absolute ? 0 : start_ns) + static_cast<std::uint64_t>(std::llround(seconds * 1e9));
}

Result<ExportOptions> export_options(const ConvertJob& job, MessageLog& log) {
  ExportOptions options{.kind = job.kind};
  std::vector<std::string> known;
  for (const LogChannel& channel : log.channels()) known.push_back(channel.topic);
  for (const std::string& topic : job.topics) {
    if (std::ranges::find(known, topic) == known.end())
      return fail(ErrorCode::NotFound, fmt::format("the recording has no topic '{}'", topic),
                  {.source = job.inputs.front()}, suggestion(topic, known));
    options.selection.topics.insert(topic);
  }
  const std::uint64_t start = recording_start_ns(log);
  if (!job.from.empty()) {
    const auto from = moment(job.from, start, "from");
    if (!from) return tl::unexpected(from.error());
    options.selection.from = *from;
  }
  if (!job.to.empty()) {
    const auto to = moment(job.to, start, "to");
    if (!to) return tl::unexpected(to.error());
    options.selection.to = *to;
  }
  const LogSelection& chosen = options.selection;
  const auto end = log.summary().end;
  if (chosen.to <= chosen.from || (end && chosen.from > *end))
    return fail(ErrorCode::InvalidArgument, "`from` is not before `to`, or the recording ends before `from`",
                {.source = job.inputs.front(), .key = "`from`"},
                "`waymark info` shows the start and the duration of the recording.");
  return options;
}

/// An output file or bag folder. It is written to a temporary path and renamed once it is complete.
struct Output {
  fs::path path;
  fs::path temporary;
};

Result<Output> output_of(const ConvertJob& job, const std::string& format) {
  std::string name = job.output;
  while (format == "rosbag2" && name.size() > 1 && name.ends_with('/')) name.pop_back();
  Output out{.path = name, .temporary = fmt::format("{}.{}.part", name, ::getpid())};
  std::error_code ignored;
  if (fs::is_directory(out.path, ignored))
    return format == "rosbag2"
               ? fail(ErrorCode::Unwritable, "the folder already exists", {.source = job.output},
                      "A bag needs a new folder. Choose another name, or remove the folder.")
               : fail(ErrorCode::Unwritable, "the output is a folder", {.source = job.output},
                      "Give a file name.");
  if (fs::exists(out.path, ignored) && !fs::is_regular_file(out.path, ignored))
    return fail(ErrorCode::Unwritable, "the output is a device or a pipe, not a regular file",
                {.source = job.output}, "Give a file name.");
  const fs::path folder = out.path.parent_path();
  if (format == "rosbag2" && !folder.empty() && fs::exists(folder / "metadata.yaml", ignored))
    return fail(ErrorCode::Unwritable, "the parent folder of the output is a bag", {.source = job.output},
                "Choose a name outside this folder.");
  if (fs::exists(out.path, ignored))
    return fail(ErrorCode::Unwritable, "the file already exists", {.source = job.output},
                "Recordings are never overwritten. Choose another name, or remove the file.");
  return out;
}

Result<std::string> format_of(const ConvertJob& job) {
  const std::string name = job.format.empty() ? fs::path(job.output).extension().string() : "." + job.format;
  if (name == ".mcap" || name == ".rosbag2" || name == ".tum" || name == ".csv") return name.substr(1);
  return fail(ErrorCode::InvalidArgument,
              name.size() < 2 ? "the name of the output has no extension"
                              : fmt::format("unknown format '{}'", name.substr(1)),
              {.source = job.output, .key = "`output`"},
              "Use the extension .mcap, .tum or .csv, or set `format`; `format=rosbag2` writes a folder.");
}

/// Fails if `kind` is set but the format stores all kinds of samples.
Status check_kind(const ConvertJob& job, const std::string& format) {
  if (job.kind.empty() || format == "csv") return {};
  return fail(ErrorCode::InvalidArgument, fmt::format("'{}' has no effect on {}", job.kind, format),
              {.key = "kind"}, "Use an output that ends in .csv, or `topics` for other formats.");
}

/// The layout of a bag. Fails if bag options are set for any other format.
Result<BagFormat> bag_format_of(const ConvertJob& job, const std::string& format) {
  BagFormat bag;
  const std::string& unused = job.ros_distro.empty() ? job.storage : job.ros_distro;
  if (format != "rosbag2" && !unused.empty())
    return fail(ErrorCode::InvalidArgument,
                fmt::format("'{}' has no effect on the format {}", unused, format),
                {.key = job.ros_distro.empty() ? "storage" : "ros_distro"},
                "Set `format=rosbag2`, or omit this option.");
  if (!job.ros_distro.empty() && job.ros_distro != "humble" && job.ros_distro != "jazzy")
    return fail(ErrorCode::InvalidArgument, fmt::format("unknown ROS distribution '{}'", job.ros_distro),
                {.key = "ros_distro"}, "Use humble for releases up to Iron, and jazzy for later ones.");
  if (!job.storage.empty() && job.storage != "sqlite3" && job.storage != "mcap")
    return fail(ErrorCode::InvalidArgument, fmt::format("unknown storage '{}'", job.storage),
                {.key = "storage"}, "Use sqlite3 or mcap.");
  if (job.ros_distro == "humble") bag = {BagRelease::Humble, BagStorage::Sqlite};
  if (!job.storage.empty()) bag.storage = job.storage == "mcap" ? BagStorage::Mcap : BagStorage::Sqlite;
  return bag;
}

std::map<std::string, std::string> provenance(const ConvertJob& job, const MessageLog& log) {
  std::vector<std::string> names;
  names.reserve(job.inputs.size());
  for (const std::string& input : job.inputs) names.push_back(fs::path(input).filename().string());
  return {{"verb", "convert"},
          {"version", WAYMARK_VERSION},
          {"source", fmt::format("{}", fmt::join(names, ", "))},
          {"source_format", log.description()}};
}

Result<ExportReport> write_temporary(const std::string& format, const BagFormat& bag, MessageLog& log,
                                     const Output& out, const ExportOptions& options) {
  if (format == "rosbag2")
    return export_rosbag2(log, out.temporary, out.path.filename().string(), bag, options);
  Result<std::unique_ptr<ByteSink>> sink = create_file(out.temporary);
  if (!sink) return tl::unexpected(sink.error());
  return format == "mcap"  ? export_mcap(log, std::move(*sink), options)
         : format == "tum" ? export_tum(log, std::move(*sink), options)
                           : export_csv(log, std::move(*sink), options);
}

Result<ExportReport> write_out(const std::string& format, const BagFormat& bag, MessageLog& log,
                               const Output& out, const ExportOptions& options) {
  Result<ExportReport> report = write_temporary(format, bag, log, out, options);
  std::error_code error;
  if (report) fs::rename(out.temporary, out.path, error);
  if (report && !error) return report;
  std::error_code ignored;
  fs::remove_all(out.temporary, ignored);
  // Errors must name the requested path, not the temporary one.
  if (!report && report.error().place.source.starts_with(out.temporary.string()))
    report.error() = named_output(std::move(report.error()), out.path);
  if (error) return fail(ErrorCode::Unwritable, error.message(), {.source = out.path.string()});
  return report;
}

/// Adds a robot's camera to recordings that contain no camera calibration.
Status add_robot(const ConvertJob& job, const std::string& format, const MessageLog& log,
                 ExportOptions& options) {
  if (job.robot.empty()) return {};
  if ((format != "mcap" && format != "rosbag2") || !gives_samples(log.format()))
    return fail(
        ErrorCode::InvalidArgument,
        "the robot's camera is added only when tables or LCM logs are written as MCAP, not to ROS recordings",
        {.key = "robot"}, "Omit `robot`; set it for `waymark map` or `waymark localize` instead.");
  RecordingSetup setup;
  std::vector<std::string> ignored;
  if (Status status = take_robot(job.robot, setup, ignored); !status) return status;
  options.camera = setup.camera;
  options.base_T_cam = setup.base_T_cam;
  return {};
}

/// Changes the error code, because an unreadable or unwritable file does not make the job invalid.
Error about_files(Error error) {
  if (error.code == ErrorCode::InvalidArgument) error.code = ErrorCode::Unreadable;
  return error;
}

}  // namespace

Status check_no_recording(const GivenFields& given) {
  FieldRefusals refused(given);
  refused.fields(true, {"format", "topics", "from", "to", "kind", "robot", "tag_latency_s"},
                 "the input is not a recording", "Omit this option.");
  return refused.status();
}

ConvertJob described_convert(const ConvertRequest& request) {
  ConvertJob job = request.job;
  job.inputs = {request.first};
  job.inputs.insert(job.inputs.end(), request.rest.begin(), request.rest.end() - 1);
  job.output = request.rest.back();
  return job;
}

Result<ConvertReport> convert_log(const ConvertJob& job, const JobControl& control) {
  const Result<std::string> format = format_of(job);
  if (format) {
    if (Status status = check_kind(job, *format); !status) return tl::unexpected(status.error());
  }
  const Result<BagFormat> bag = format ? bag_format_of(job, *format) : tl::unexpected(format.error());
  const Result<Output> out = bag ? output_of(job, *format) : tl::unexpected(bag.error());
  if (!out) return tl::unexpected(out.error());
  const auto latency = Duration(std::llround(job.tag_latency_s * 1e9));
  const Result<std::unique_ptr<MessageLog>> log =
      open_recordings(job.inputs, control, {.mbot_camera_latency = latency});
  if (!log) return tl::unexpected(about_files(log.error()));
  Result<ExportOptions> options = export_options(job, **log);
  if (!options) return tl::unexpected(options.error());
  options->metadata["waymark_convert"] = provenance(job, **log);
  if (Status status = add_robot(job, *format, **log, *options); !status)
    return tl::unexpected(status.error());
  options->progress = [&](double done) -> Status {
    control.progress({fmt::format("{} {:.0f} %", job.output, 100 * done)});
    return control.cancelled() ? Status(fail(ErrorCode::Unwritable, "stopped: nothing was written"))
                               : Status{};
  };
  Result<ExportReport> report = write_out(*format, *bag, **log, *out, *options);
  if (!report) {
    Error failed = about_files(report.error());
    if (failed.code == ErrorCode::NotFound && failed.place.source.empty())
      failed.place.source = job.inputs.front();
    return tl::unexpected(failed);
  }
  return ConvertReport{.inputs = job.inputs,
                       .output = job.output,
                       .format = *format,
                       .input_format = (*log)->format(),
                       .input_description = (*log)->description(),
                       .exported = std::move(*report)};
}

namespace {

struct ConvertProblem {
  LogProblem problem{};
};

ReportFields fields(const ConvertProblem& listed) {
  const LogProblem& problem = listed.problem;
  return {{"kind", "Recordings: damage, or trap (intact data that are easily misinterpreted)",
           problem.kind == LogProblem::Kind::Damage ? "damage" : "trap"},
          {"key", "Stable name of the problem", problem.key},
          {"count", "Number of occurrences", problem.count},
          {"message", "Error message, with the place of the first occurrence", to_string(problem.error)}};
}

}  // namespace

ReportFields fields(const ConvertReport& report) {
  const std::vector<ConvertProblem> problems(report.exported.problems.begin(),
                                             report.exported.problems.end());
  ReportFields topics;
  for (const auto& [topic, count] : report.exported.by_topic) topics.push_back({topic, {}, count});
  const bool merged = report.inputs.size() > 1;
  const std::string input = report.inputs.empty() ? std::string() : report.inputs.front();
  return {
      {"input", "File that was read, or a list of the merged recordings",
       merged ? ReportValue(report.inputs) : ReportValue(input)},
      {"input_format", "Format, detected from the content: mcap, rosbag2, ros1bag, lcm, csv, video or camera",
       to_string(report.input_format)},
      {"output", "File or folder that was written", report.output},
      {"output_format", "mcap, rosbag2, tum or csv", report.format},
      {"messages", "Recordings: number of messages or lines written", report.exported.messages},
      {"topics", "Recordings: number of messages by topic", topics},
      {"problems", "Defects of the input, and messages that could not be written", problems}};
}

std::string to_text(const ConvertReport& report) {
  std::string text = fmt::format(
      "{} ({}) to {}: {} {}\n", fmt::join(report.inputs, ", "), report.input_description, report.output,
      report.exported.messages, report.format == "mcap" || report.format == "rosbag2" ? "messages" : "lines");
  for (const auto& [topic, count] : report.exported.by_topic)
    text += fmt::format("  {:<32} {:>9}\n", topic, count);
  return text;
}

}  // namespace waymark
