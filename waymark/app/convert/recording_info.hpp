#pragma once

#include <map>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/recording/log_report.hpp"

/// What `waymark info` says of a recording.
namespace waymark {

/// What can be done with a recording next.
struct NextStep {
  std::string sentence{};
  std::string command{};  ///< empty where nothing can be done about it
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

struct InfoJob {
  std::string file{};
  bool quick = false;  ///< the index alone

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.file,
          JobField("file FILE",
                   "Recording of any kind: MCAP, rosbag2, ROS 1 bag, LCM event log, CSV; also compressed")
              .input()
              .required());
    visit(self.quick, JobField("quick", "Read only the index, so gaps and clock jumps are not reported"));
  }
};

/// Reads what is to be told; all messages unless `quick`. Cancelling ends the
/// counting: what was read until then is told.
[[nodiscard]] Result<RecordingInfo> look_at(const std::string& file, bool quick, const JobControl& control);

/// Which verbs take this recording, and what it lacks for the others.
[[nodiscard]] std::vector<NextStep> next_steps(const RecordingInfo& info);
[[nodiscard]] ReportFields fields(const NextStep& step);

[[nodiscard]] ReportFields fields(const RecordingInfo& info);

/// What `waymark info` prints: head, topics, stamps, metadata, attachments, what can be done next.
[[nodiscard]] std::string to_text(const RecordingInfo& info);

}  // namespace waymark
