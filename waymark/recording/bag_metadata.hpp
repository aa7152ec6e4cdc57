#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/recording/message_log.hpp"
#include "waymark/recording/offered_qos.hpp"

/// What stands about a bag of rosbag2 beside its messages (ros2/rosbag2, rosbag2_storage/yaml.hpp).
namespace waymark {

/// A release of ROS 2, as far as its bags differ: Humble writes version 5 of the metadata, Jazzy version 9.
enum class BagRelease : std::uint8_t { Humble, Jazzy };
/// The plugin that stores the messages.
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

/// A bag of one file.
struct BagContents {
  std::string file{};                  ///< its name within the folder
  std::vector<LogChannel> channels{};  ///< with the number of their messages, CDR
  std::uint64_t start_ns = 0;
  std::uint64_t end_ns = 0;  ///< time of the last message
};

/// The text of metadata.yaml, in the order of rosbag2's own keys.
[[nodiscard]] std::string bag_metadata(const BagFormat& format, const BagContents& contents);

}  // namespace waymark
