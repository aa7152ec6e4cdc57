#pragma once

#include <filesystem>
#include <functional>

#include "waymark/recording/bag_metadata.hpp"

namespace waymark {

/// Writes all messages of a recording in CDR to a new .db3 file of rosbag2, with the tables of the release
/// (schema 3 of Humble, 4 of Jazzy; ros2/rosbag2, rosbag2_storage_sqlite3/sqlite_storage.cpp). The text of
/// metadata.yaml stands in the table `metadata`, too. `progress` is called with each message's time; an error
/// it gives stops the export. What is left of a file after an error must be removed by the caller.
[[nodiscard]] Status write_sqlite_bag(MessageLog& log, const std::filesystem::path& path,
                                      const BagFormat& format, const BagContents& contents,
                                      const std::function<Status(std::uint64_t log_time)>& progress);

}  // namespace waymark
