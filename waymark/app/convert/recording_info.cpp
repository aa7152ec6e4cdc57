#include "waymark/app/convert/recording_info.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace waymark {
namespace {

nlohmann::ordered_json to_json(const TopicReport& topic, bool quick) {
  nlohmann::ordered_json json = {{"topic", topic.topic},
                                 {"type", topic.type},
                                 {"encoding", topic.encoding},
                                 {"messages", topic.messages},
                                 {"rate_hz", topic.rate_hz}};
  if (quick) return json;
  const StampStatistics& stamps = topic.stamps;
  json["stamps"] = topic.has_header ? "header" : "log";
  json["periodic"] = stamps.periodic();
  json["gaps"] = stamps.gaps();
  json["dropped"] = stamps.dropped();
  json["longest_interval_s"] = static_cast<double>(stamps.longest_ns()) * 1e-9;
  json["duplicate_stamps"] = stamps.duplicate();
  json["zero_stamps"] = stamps.zero();
  json["backward_stamps"] = stamps.backward();
  json["clock_jumps"] = topic.clock_jumps;
  json["largest_clock_jump_s"] = topic.largest_jump_s;
  return json;
}

/// What stands in the way of using its camera.
void add_doubts(RecordingInfo& info) {
  const ChosenCamera& chosen = info.setup.chosen;
  for (const auto& doubt : {chosen.ambiguous, chosen.camera_error, chosen.mounting_error})
    if (doubt) info.problems.push_back({LogProblem::Kind::Trap, "camera", *doubt});
}

}  // namespace

Result<RecordingInfo> look_at(const std::string& file, bool quick, const JobControl& control) {
  Result<std::unique_ptr<MessageLog>> opened = open_log(file, control.log_options());
  if (!opened) return tl::unexpected(opened.error());
  MessageLog& log = **opened;
  RecordingInfo info{.file = file,
                     .format = log.format(),
                     .description = log.description(),
                     .summary = log.summary(),
                     .quick = quick,
                     .attachments = log.attachments()};
  Result<LogContents> contents = contents_of(log, !quick);
  if (!contents) return tl::unexpected(contents.error());
  info.problems = log.problems();  // what its messages mean; a visit forgets what the one before noticed
  info.contents = std::move(*contents);
  // What the recording says of its robot helps; a camera that makes no sense is a problem, not the end.
  Result<RecordingSetup> setup = log.setup();
  if (setup) info.setup = std::move(*setup);
  if (quick) {
    info.report = quick_report_on(log);
  } else {
    std::uint64_t first = 0;
    Result<LogReport> report = report_on(log, [&](std::uint64_t log_time) {
      if (first == 0) first = log_time;
      const std::uint64_t since = log_time > first ? log_time - first : 0;
      control.progress({fmt::format("{}: {:.0f} s", file, static_cast<double>(since) * 1e-9)});
      return !control.cancelled();
    });
    if (!report) return tl::unexpected(report.error());
    info.report = std::move(*report);
  }
  for (LogProblem& problem : log.problems())
    if (std::ranges::find(info.problems, problem.key, &LogProblem::key) == info.problems.end())
      info.problems.push_back(std::move(problem));
  if (!setup) info.problems.push_back({.key = "setup", .error = setup.error()});
  add_doubts(info);
  return info;
}

nlohmann::ordered_json to_json(const RecordingInfo& info) {
  using Json = nlohmann::ordered_json;
  Json topics = Json::array();
  for (const TopicReport& topic : info.report.topics) topics.push_back(to_json(topic, info.quick));
  Json metadata = Json::object();
  for (const auto& [name, values] : info.setup.metadata) metadata[name] = values;
  Json attachments = Json::array();
  for (const LogAttachment& a : info.attachments)
    attachments.push_back({{"name", a.name}, {"media_type", a.media_type}, {"size_bytes", a.size_bytes}});
  Json problems = Json::array();
  Json traps = Json::array();
  for (const LogProblem& problem : info.problems) {
    if (problem.kind == LogProblem::Kind::Damage) {
      problems.push_back(to_string(problem.error));
    } else {
      traps.push_back({{"key", problem.key}, {"count", problem.count}, {"words", to_string(problem.error)}});
    }
  }
  Json next = Json::array();
  for (const NextStep& step : next_steps(info))
    next.push_back({{"sentence", step.sentence}, {"command", step.command}});
  return {{"file", info.file},
          {"format", to_string(info.format)},
          {"size_bytes", info.summary.size_bytes},
          {"library", info.summary.library},
          {"profile", info.summary.profile},
          {"complete", info.summary.complete},
          {"start_ns", info.report.start_ns},
          {"duration_s", info.report.duration_s},
          {"messages", info.report.messages},
          {"chunks", info.summary.chunks.value_or(0)},
          {"topics", topics},
          {"contents", info.contents},
          {"metadata", metadata},
          {"attachments", attachments},
          {"problems", problems},
          {"traps", traps},
          {"next", next}};
}

}  // namespace waymark
