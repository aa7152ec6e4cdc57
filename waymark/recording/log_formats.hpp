#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "waymark/recording/message_log.hpp"

/// The formats of recordings: one row of the table in log_formats.cpp each.
namespace waymark {

/// A file is recognised by at most so many of its first bytes.
inline constexpr std::size_t kHeadBytes = std::size_t{1} << 16U;

/// Opens bytes that are not packed by the format that `head`, their first ones, begin. Fails on those of no
/// format.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_by_format(std::unique_ptr<ByteSource> source,
                                                                 ByteSpan head, const LogOptions& options);

/// Whether bytes begin as an SQLite file, which is read by its path.
[[nodiscard]] bool begins_as_sqlite(ByteSpan head);

/// Whether a file begins as a recording does (MCAP, rosbag2, ROS 1 bag, LCM; a table could be anything), or
/// as a packed one may. Reads the first bytes of a regular file; pipes are left alone.
[[nodiscard]] bool looks_like_recording(const std::string& path);

/// Whether recordings of this format give samples of the robot rather than messages with types of ROS.
[[nodiscard]] bool gives_samples(LogFormat format);

}  // namespace waymark
