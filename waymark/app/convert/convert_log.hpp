#pragma once

#include <string>
#include <vector>

#include "waymark/app/common/field_refusals.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/recording/export_log.hpp"

/// `waymark convert`: converts a recording in any format to MCAP, rosbag2, TUM or CSV.
namespace waymark {

struct ConvertJob {
  std::vector<std::string> inputs{};  ///< recordings from the same drive, merged by timestamp
  std::string output{};               ///< a new file, or a new folder for rosbag2
  std::string format{};      ///< mcap, rosbag2, tum or csv; if empty, chosen by the extension of the output
  std::string ros_distro{};  ///< humble or jazzy, for rosbag2; if empty, jazzy
  std::string storage{};     ///< sqlite3 or mcap, for rosbag2; if empty, the default of the ROS release
  std::vector<std::string> topics{};  ///< topics to convert; if empty, all topics
  /// Seconds after the start or, with a leading @, on the recording's clock; if empty, no limit.
  std::string from{};
  std::string to{};
  std::string kind{};            ///< content of a .csv output: detections, odometry, imu or range-bearing
  std::string robot{};           ///< file or name of a robot whose camera is added to tables and LCM logs
  double tag_latency_s = 0.065;  ///< camera latency of an MBot, from exposure to timestamp

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.format,
          JobField("format NAME",
                   "Output format: mcap, rosbag2, tum or csv. Default: from the extension of OUT"));
    visit(self.ros_distro,
          JobField(
              "ros_distro NAME",
              "ROS 2 release whose layout is written by `format=rosbag2`: humble or jazzy (default: jazzy)"));
    visit(self.storage,
          JobField(
              "storage NAME",
              "Storage format for `format=rosbag2`: sqlite3 (default in Humble) or mcap (default in Jazzy)"));
    visit(self.topics,
          JobField("topics A,B", "Only these topics, comma-separated").also("topic").comma_separated());
    visit(
        self.from,
        JobField("from T", "Start of the interval [s]: after the start, or with @ on the recording's clock"));
    visit(self.to,
          JobField("to T", "End of the interval [s]: after the start, or with @ on the recording's clock"));
    visit(self.kind,
          JobField("kind NAME", "Content of a .csv file: detections, odometry, imu or range-bearing")
              .one_of("detections,odometry,imu,range-bearing"));
    visit(
        self.robot,
        JobField(
            "robot FILE",
            "Robot file or name; its camera and mounting are added to tables and LCM logs written as MCAP"));
    visit(self.tag_latency_s,
          JobField("tag_latency_s S",
                   "For LCM logs from an MBot: camera latency, the time from exposure to image stamp [s]",
                   0.0, 10.0));
  }
};

/// User options for a conversion: the recordings, followed by the output.
struct ConvertRequest {
  std::string first{};
  std::vector<std::string> rest{};  ///< additional inputs, followed by the output
  ConvertJob job{};                 ///< without inputs and output

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.first, JobField("first IN",
                               "Recording: MCAP, rosbag2 (.db3, folder), ROS 1 bag, LCM event log, CSV; a "
                               "video; or a live camera")
                          .input()
                          .required());
    visit(self.rest, JobField("rest OUT",
                              "New file: .mcap, .tum or .csv; new folder for `format=rosbag2`. Additional "
                              "recordings of the same drive may precede it and are merged by stamp")
                         .input()
                         .required());
    ConvertJob::fields(self.job, visit);
  }
};
/// The job, including inputs and output.
[[nodiscard]] ConvertJob described_convert(const ConvertRequest& request);

/// Fails if options are given that only apply to recordings. Call this if the input is not a recording.
[[nodiscard]] Status check_no_recording(const GivenFields& given);

struct ConvertReport {
  std::vector<std::string> inputs{};
  std::string output{};
  std::string format{};  ///< format of the output
  LogFormat input_format = LogFormat::Mcap;
  std::string input_description{};
  ExportReport exported{};
};

/// Converts the recordings. The output file does not appear until it is complete. The error code is
/// InvalidArgument for an invalid job, and a different one for file errors.
[[nodiscard]] Result<ConvertReport> convert_log(const ConvertJob& job, const JobControl& control);
/// The number of messages written, by topic.
[[nodiscard]] std::string to_text(const ConvertReport& report);
[[nodiscard]] ReportFields fields(const ConvertReport& report);

}  // namespace waymark
