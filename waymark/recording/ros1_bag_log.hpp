#pragma once

#include "waymark/recording/message_log.hpp"

namespace waymark {

/// A ROS 1 bag, version 2.0; with or without its index, chunks packed with bz2, lz4 or not at all.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_ros1_bag(std::unique_ptr<ByteSource> source,
                                                                const LogOptions& options);

}  // namespace waymark
