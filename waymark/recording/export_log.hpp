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

/// Recordings of any format written as another.
namespace waymark {

struct ExportOptions {
  LogSelection selection{};
  std::string
      kind{};  ///< of CSV: "detections", "odometry", "imu", "range-bearing"; empty: the only one there is
  /// Blocks of metadata to add (MCAP).
  std::map<std::string, std::map<std::string, std::string>> metadata{};
  /// What becomes part of an MCAP of samples: the camera and where it sits.
  std::optional<CameraModel> camera{};
  std::optional<SE3> base_T_cam{};
  /// How the qualities of service of an MCAP's topics are rewritten; unless given they pass as they are.
  std::optional<QosNotation> qos{};
  /// Called now and then with the part that is done, 0 to 1; an error it gives stops the export.
  std::function<Status(double done)> progress = {};
};

struct ExportReport {
  std::uint64_t messages = 0;                       ///< written, or lines
  std::map<std::string, std::uint64_t> by_topic{};  ///< as they are called in what was written
  std::vector<LogProblem> problems{};  ///< of the source, and of messages that could not be written
};

/// As MCAP: CDR passes as it is, with schema and metadata; ROS 1 messages are rewritten by their definitions;
/// LCM and CSV become samples and those our messages. Metadata and attachments come along.
[[nodiscard]] Result<ExportReport> export_mcap(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                               const ExportOptions& options);

/// As a bag of rosbag2: a new folder with metadata.yaml and one file, `name`_0.mcap or .db3, in the layout of
/// the release; messages as export_mcap() writes them. After an error the folder is incomplete, and the
/// caller removes it.
[[nodiscard]] Result<ExportReport> export_rosbag2(MessageLog& log, const std::filesystem::path& folder,
                                                  const std::string& name, const BagFormat& format,
                                                  const ExportOptions& options);

/// The poses of one topic as TUM lines (timestamp [s] tx ty tz [m] qx qy qz qw). Without a topic in the
/// selection the only one that has poses; fails, naming them, when there are several or none.
[[nodiscard]] Result<ExportReport> export_tum(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                              const ExportOptions& options);

/// Samples of one kind as a table whose columns name their units; open_log() reads it back.
[[nodiscard]] Result<ExportReport> export_csv(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                              const ExportOptions& options);

}  // namespace waymark
