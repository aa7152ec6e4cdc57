#pragma once

#include <map>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/localization/sensor_diagnosis.hpp"
#include "waymark/recording/log_report.hpp"

/// `waymark info`: summarises a recording.
namespace waymark {

/// A possible next step with a recording.
struct NextStep {
  std::string sentence{};
  std::string command{};  ///< empty if no command applies
};

struct RecordingInfo {
  std::string file{};
  LogFormat format = LogFormat::Mcap;
  std::string description{};
  LogSummary summary{};
  LogReport report{};
  bool quick = false;  ///< whether only the index was read; if so, timestamps were not analysed
  LogContents contents{};
  RecordingSetup setup{};
  std::vector<LogAttachment> attachments{};
  std::vector<LogProblem> problems{};
  std::vector<SensorFinding> sensors{};  ///< faults of sensors; not with `quick`
};

struct InfoJob {
  std::string file{};
  bool quick = false;  ///< whether to read only the index

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.file,
          JobField("file FILE", "Recording: MCAP, rosbag2, ROS 1 bag, LCM event log or CSV, also compressed")
              .input()
              .required());
    visit(self.quick, JobField("quick", "Read only the index, so gaps and clock jumps are not reported"));
  }
};

/// Reads all messages in the recording, or only its index if `quick`. If cancelled, the summary covers the
/// part that has been read.
[[nodiscard]] Result<RecordingInfo> look_at(const std::string& file, bool quick, const JobControl& control);

/// The verbs that can use this recording, and the additional data required by others.
[[nodiscard]] std::vector<NextStep> next_steps(const RecordingInfo& info);
[[nodiscard]] ReportFields fields(const NextStep& step);

[[nodiscard]] ReportFields fields(const RecordingInfo& info);

/// The text printed by `waymark info`: overview, topics, timestamps, metadata, attachments and next steps.
[[nodiscard]] std::string to_text(const RecordingInfo& info);

}  // namespace waymark
