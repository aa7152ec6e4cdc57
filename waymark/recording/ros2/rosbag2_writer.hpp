#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros2/offered_qos.hpp"

/// Metadata of a rosbag2 bag (ros2/rosbag2, rosbag2_storage/yaml.hpp).
namespace waymark {

/// ROS 2 releases with different bag layouts: Humble writes version 5 of the metadata, Jazzy version 9.
enum class BagRelease : std::uint8_t { Humble, Jazzy };
/// The storage plugin.
enum class BagStorage : std::uint8_t { Sqlite, Mcap };

struct BagFormat {
  BagRelease release = BagRelease::Jazzy;
  BagStorage storage = BagStorage::Mcap;

  [[nodiscard]] int metadata_version() const { return release == BagRelease::Humble ? 5 : 9; }
  [[nodiscard]] int sqlite_schema() const { return release == BagRelease::Humble ? 3 : 4; }
  [[nodiscard]] std::string_view distro() const { return release == BagRelease::Humble ? "humble" : "jazzy"; }
  [[nodiscard]] std::string_view storage_name() const {
    return storage == BagStorage::Sqlite ? "sqlite3" : "mcap";
  }
  [[nodiscard]] std::string_view suffix() const { return storage == BagStorage::Sqlite ? ".db3" : ".mcap"; }
  [[nodiscard]] QosNotation qos() const {
    return release == BagRelease::Humble ? QosNotation::Numbers : QosNotation::Names;
  }
};

/// A bag that consists of one file.
struct BagContents {
  std::string file{};                  ///< name within the folder
  std::vector<LogChannel> channels{};  ///< with message counts, in CDR
  std::uint64_t start_ns = 0;
  std::uint64_t end_ns = 0;  ///< time of the last message
};

/// The text of metadata.yaml, with keys in the same order as in rosbag2.
[[nodiscard]] std::string bag_metadata(const BagFormat& format, const BagContents& contents);

/// Writes all messages of a recording in CDR to a new rosbag2 .db3 file, with the tables of the release
/// (schema 3 for Humble, 4 for Jazzy; ros2/rosbag2, rosbag2_storage_sqlite3/sqlite_storage.cpp). The table
/// `metadata` also contains the text of metadata.yaml. `progress` is called with each message's time; an
/// error that it returns stops the export. After an error, the caller must remove the file.
[[nodiscard]] Status write_sqlite_bag(MessageLog& log, const std::filesystem::path& path,
                                      const BagFormat& format, const BagContents& contents,
                                      const std::function<Status(std::uint64_t log_time)>& progress);

}  // namespace waymark
