#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "waymark/recording/mcap/index.hpp"

namespace waymark::mcap {

/// What became of a file whose writer died, or that was cut or damaged.
struct Recovery {
  std::uint64_t messages = 0;
  std::uint64_t chunks = 0;
  std::uint64_t kept_bytes = 0;   ///< of the data section
  std::uint64_t lost_bytes = 0;   ///< behind the last whole record, and of records that are damaged
  bool was_whole = false;         ///< nothing was missing or damaged, the summary included
  std::vector<Error> problems{};  ///< of the file as it was
};

/// Copies every whole record, byte for byte, and writes message indexes and a summary for them: chunks and
/// attachments whose checksum is wrong, records whose length is damaged (the summary tells where the
/// next begins; without one the next chunk is searched for) and what follows the last whole record are left
/// out. One pass; memory: a chunk and an index entry for each.
[[nodiscard]] Result<Recovery> recover(const ByteSource& source, std::unique_ptr<ByteSink> sink,
                                       const ReaderOptions& options = {});

/// The same from file to file. `out` appears whole, or not at all (beside it grows OUT.part); it must not
/// exist. `in` is only read.
[[nodiscard]] Result<Recovery> recover_file(const std::filesystem::path& in, const std::filesystem::path& out,
                                            const ReaderOptions& options = {});

}  // namespace waymark::mcap
