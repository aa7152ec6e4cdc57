#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "waymark/recording/log_problems.hpp"
#include "waymark/recording/ros1_bag_records.hpp"

namespace waymark::ros1bag {

/// A chunk, or (in a bag nobody chunked) a message that stands alone.
struct ChunkEntry {
  std::uint64_t offset = 0;
  std::uint64_t start_time = 0;  ///< [ns] of the first message
  std::uint64_t end_time = 0;    ///< [ns] of the last
  bool bare_message = false;
};

struct Index {
  std::map<std::uint32_t, Connection> connections{};
  std::vector<ChunkEntry> chunks{};                 ///< in file order
  std::map<std::uint32_t, std::uint64_t> counts{};  ///< messages of a connection
  bool from_file = false;                           ///< the bag's own index was there and fits
  std::string compression{};                        ///< of the first chunk: "none", "bz2", "lz4"
};

/// A chunk unpacked: all of it, or what precedes its damage.
struct OpenChunk {
  Bytes records{};
  std::optional<Error> damage{};
};

/// Unpacks the chunk at an offset (a bare message is given as it stands).
[[nodiscard]] Result<OpenChunk> open_chunk(const ByteSource& source, const ChunkEntry& entry,
                                           std::uint64_t max_bytes);

/// Calls visit for each record of an unpacked chunk until one is none; false then.
bool visit_chunk(ByteSpan records, const std::function<void(const Record&)>& visit);

/// The bag's own index, or, where there is none or it does not fit, one pass over the file. Damage ends the
/// pass and is noted. Fails when it is no bag at all.
[[nodiscard]] Result<Index> read_index(const ByteSource& source, std::uint64_t max_chunk_bytes,
                                       LogProblems& problems);

}  // namespace waymark::ros1bag
