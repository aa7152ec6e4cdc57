#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "waymark/recording/mcap/index.hpp"

namespace waymark::mcap {

/// Result of recovering a file that is incomplete, truncated or damaged.
struct Recovery {
  std::uint64_t messages = 0;
  std::uint64_t chunks = 0;
  std::uint64_t kept_bytes = 0;   ///< size of the data section
  std::uint64_t lost_bytes = 0;   ///< bytes after the last complete record and in damaged records
  bool was_whole = false;         ///< the file was complete and undamaged, including the summary
  std::vector<Error> problems{};  ///< problems of the original file
};

/// Copies every complete record byte for byte and writes message indexes and a summary for them. Omits chunks
/// and attachments with a wrong checksum, records with a damaged length, and everything after the last
/// complete record. After a damaged length, it continues at the next record listed in the summary or, without
/// a summary, searches for the next chunk. Makes one pass and holds one chunk and an index entry per chunk in
/// memory.
[[nodiscard]] Result<Recovery> recover(const ByteSource& source, std::unique_ptr<ByteSink> sink,
                                       const ReaderOptions& options = {});

/// Recovers one file into another. `out` must not exist. It is written as OUT.part and renamed when complete.
/// `in` is only read.
[[nodiscard]] Result<Recovery> recover_file(const std::filesystem::path& in, const std::filesystem::path& out,
                                            const ReaderOptions& options = {});

}  // namespace waymark::mcap
