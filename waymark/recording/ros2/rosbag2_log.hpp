#pragma once

#include <memory>

#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {

inline constexpr std::string_view kSqliteMagic{"SQLite format 3\0", 16};

/// One .db3 file of rosbag2. `name` stands in messages; `packed_messages`: each message is packed with zstd
/// on its own (compression mode "message" of a bag's metadata.yaml).
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_rosbag2_file(const std::filesystem::path& path,
                                                                    const std::string& name,
                                                                    bool packed_messages,
                                                                    const LogOptions& options);

/// The same of a file without a name.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_rosbag2_bytes(
    const std::shared_ptr<const TemporaryFile>& file, const std::string& name, const LogOptions& options);

/// A bag folder: the files its metadata.yaml lists, .db3 or .mcap, as one recording.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_bag_folder(const std::filesystem::path& folder,
                                                                  const LogOptions& options);

}  // namespace waymark
