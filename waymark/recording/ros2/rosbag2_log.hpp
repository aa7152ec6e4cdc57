#pragma once

#include <memory>

#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {

inline constexpr std::string_view kSqliteMagic{"SQLite format 3\0", 16};

/// Opens one .db3 file of rosbag2. `name` is used in messages. If `packed_messages`, each message is
/// compressed separately with zstd (compression mode "message" in a bag's metadata.yaml).
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_rosbag2_file(const std::filesystem::path& path,
                                                                    const std::string& name,
                                                                    bool packed_messages,
                                                                    const LogOptions& options);

/// Opens an unnamed file.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_rosbag2_bytes(
    const std::shared_ptr<const TemporaryFile>& file, const std::string& name, const LogOptions& options);

/// Opens a bag folder: the files listed in its metadata.yaml, .db3 or .mcap, as one recording.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_bag_folder(const std::filesystem::path& folder,
                                                                  const LogOptions& options);

}  // namespace waymark
