#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros2/rosbag2_writer.hpp"

/// Converts recordings of any format to another format.
namespace waymark {

struct ExportOptions {
  LogSelection selection{};
  std::string kind{};  ///< kind of samples in a CSV file: "detections", "odometry", "imu", "range-bearing";
                       ///< if empty, the only kind in the recording
  /// Metadata blocks to add to an MCAP file.
  std::map<std::string, std::map<std::string, std::string>> metadata{};
  /// The camera and its mounting, stored in MCAP files that contain samples.
  std::optional<CameraModel> camera{};
  std::optional<SE3> base_T_cam{};
  /// Notation of the QoS profiles of the topics in an MCAP file; if unset, the profiles are copied unchanged.
  std::optional<QosNotation> qos{};
  /// Called periodically with the completed fraction (0 to 1); an error that it returns stops the export.
  std::function<Status(double done)> progress = {};
};

struct ExportReport {
  std::uint64_t messages = 0;                       ///< number of messages or lines written
  std::map<std::string, std::uint64_t> by_topic{};  ///< counts by topic name in the output
  std::vector<LogProblem> problems{};  ///< problems in the source, and messages that could not be written
};

/// Writes MCAP. CDR is copied with its schema and metadata; ROS 1 messages are converted by their
/// definitions; LCM and CSV become samples, written with Waymark's message types. Metadata and attachments
/// are copied.
[[nodiscard]] Result<ExportReport> export_mcap(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                               const ExportOptions& options);

/// Writes a rosbag2 bag: a new folder with metadata.yaml and one file, `name`_0.mcap or .db3, in the layout
/// of the chosen release. The messages are the same as those written by export_mcap(). After an error the
/// caller must remove the incomplete folder.
[[nodiscard]] Result<ExportReport> export_rosbag2(MessageLog& log, const std::filesystem::path& folder,
                                                  const std::string& name, const BagFormat& format,
                                                  const ExportOptions& options);

/// Writes the poses on one topic as TUM lines (timestamp [s] tx ty tz [m] qx qy qz qw). If no topic is
/// selected, the only topic with poses is used. Fails if there are none or several, which the error then
/// lists.
[[nodiscard]] Result<ExportReport> export_tum(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                              const ExportOptions& options);

/// Writes samples of one kind as a table with units in the column names; open_log() can read the table.
[[nodiscard]] Result<ExportReport> export_csv(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                              const ExportOptions& options);

}  // namespace waymark
