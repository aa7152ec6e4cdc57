#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/jobs/job_control.hpp"
#include "waymark/recording/export_log.hpp"

/// `waymark convert`: a recording of any format as MCAP, a bag of rosbag2, TUM or CSV.
namespace waymark {

struct ConvertJob {
  std::vector<std::string> inputs{};  ///< of one drive: merged in the order of their stamps
  std::string output{};               ///< new file; of rosbag2 a new folder
  std::string format{};               ///< mcap, rosbag2, tum or csv; empty: as the output's name ends
  std::string ros_distro{};           ///< of rosbag2: humble or jazzy; empty: jazzy
  std::string storage{};              ///< of rosbag2: sqlite3 or mcap; empty: as the release by itself
  std::vector<std::string> topics{};  ///< only these; empty: all
  std::string from{};  ///< seconds after the start, or @ seconds of the recording's clock; empty: all
  std::string to{};
  std::string kind{};            ///< what a .csv holds: detections, odometry, imu, range-bearing
  std::string robot{};           ///< file or name with a camera, for tables and LCM logs that become MCAP
  double tag_latency_s = 0.065;  ///< how long before its stamp an MBot's picture was taken
};

struct ConvertReport {
  std::string format{};  ///< of the output
  LogFormat input_format = LogFormat::Mcap;
  std::string input_description{};
  ExportReport exported{};
};

/// The output appears when it is whole. InvalidArgument: the job makes no sense; any other code: a file.
[[nodiscard]] Result<ConvertReport> convert_log(const ConvertJob& job, const JobControl& control);
/// What was written: messages by topic.
[[nodiscard]] std::string to_text(const ConvertJob& job, const ConvertReport& report);
[[nodiscard]] nlohmann::ordered_json to_json(const ConvertJob& job, const ConvertReport& report);

}  // namespace waymark
