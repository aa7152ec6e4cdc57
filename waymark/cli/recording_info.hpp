#pragma once

#include <map>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/recording/log_report.hpp"

/// What `waymark info` says of a recording.
namespace waymark::cli {

/// What can be done with a recording next.
struct NextStep {
  std::string sentence;
  std::string command;  ///< empty where nothing can be done about it
};

struct RecordingInfo {
  std::string file{};
  LogFormat format = LogFormat::Mcap;
  std::string description{};
  LogSummary summary{};
  LogReport report{};
  bool quick = false;  ///< stamps were not looked at
  LogContents contents{};
  RecordingSetup setup{};
  std::vector<LogAttachment> attachments{};
  std::vector<LogProblem> problems{};
};

/// Reads what is to be told; all messages unless `quick`. `progress` as of report_on().
[[nodiscard]] Result<RecordingInfo> look_at(const std::string& file, bool quick,
                                            const std::function<bool(std::uint64_t)>& progress);

/// Which verbs take this recording, and what it lacks for the others.
[[nodiscard]] std::vector<NextStep> next_steps(const RecordingInfo& info);

[[nodiscard]] nlohmann::ordered_json to_json(const RecordingInfo& info);
[[nodiscard]] std::string to_text(const RecordingInfo& info);

}  // namespace waymark::cli
