#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/mcap/records.hpp"

namespace waymark::mcap {

template <class Record>
[[nodiscard]] bool is(std::uint8_t opcode) {
  return opcode == static_cast<std::uint8_t>(Record::kOpcode);
}

/// A byte in a file as a place for errors.
[[nodiscard]] inline Place at(const ByteSource& source, std::uint64_t offset) {
  return {.source = source.name(), .byte = static_cast<std::int64_t>(offset)};
}

struct ReaderOptions {
  /// Records and unpacked chunks larger than this are rejected. A reader never holds more than two of them.
  std::uint64_t max_record_bytes = std::uint64_t{1} << 30;
  /// For files up to this size, the checksum is verified on opening, which requires reading the whole file.
  std::uint64_t max_checked_bytes = std::uint64_t{1} << 32;
  /// read_index() accepts the summary of a file whose first bytes are lost.
  bool begin_may_be_lost = false;
  /// Called for damage that a visit skips; if unset, damage ends the visit with its error.
  std::function<void(const Error&)> on_damage{};
};

/// One record as stored in the file; its content is valid until the callback returns.
struct RecordView {
  std::uint8_t opcode = 0;  ///< from enum Opcode, or from a newer version, whose records are skipped
  ByteSpan content{};
  std::uint64_t offset = 0;  ///< of the record in the file; for a record inside a chunk, that of the chunk
  bool in_chunk = false;
  std::uint64_t inner_offset = 0;  ///< for a record inside a chunk, its offset in the unpacked bytes
};

/// Location of a record according to an index.
struct KnownRecord {
  std::uint64_t offset = 0;
  std::uint8_t opcode = 0;

  friend auto operator<=>(const KnownRecord&, const KnownRecord&) = default;
};

/// Result of a sequential read.
struct StreamSummary {
  bool complete = false;         ///< the closing magic was reached
  std::uint64_t good_bytes = 0;  ///< end of the last complete record; recovery keeps everything before this
  std::uint64_t skipped_bytes = 0;  ///< bytes before good_bytes in damaged chunks, and those after a damaged
                                    ///< length up to the next known record
  std::vector<Error>
      problems{};  ///< truncation at the end, and skipped chunks with a wrong CRC or damaged compression
};

/// Reads all records sequentially, including those inside chunks (after the record of their chunk). Skips
/// chunks with damaged compression or a wrong CRC. Needs no index, so it can read a recording in progress or
/// one whose writer crashed. Fails only if the file is not an MCAP file or the callback fails; damage is
/// reported in the summary. After a record with a damaged length or opcode, it continues at the next record
/// in `known`, the records of an index in order. If there are no known records and `search` is set, it
/// continues at the next bytes that look like a chunk. The same applies if the beginning of the file is lost.
/// Holds one record and one unpacked chunk in memory.
[[nodiscard]] Result<StreamSummary> read_stream(const ByteSource& source, const ReaderOptions& options,
                                                const std::function<Status(const RecordView&)>& visit,
                                                const std::vector<KnownRecord>& known = {},
                                                bool search = false);

/// Unpacks a chunk's records (into `room`, if compressed) and verifies their CRC.
[[nodiscard]] Result<ByteSpan> unpack_chunk(const Chunk& chunk, const ReaderOptions& options, Bytes& room);

/// Calls visit for each record in the unpacked bytes (a chunk or a summary section). Fails on a truncated
/// record.
[[nodiscard]] Status visit_records(
    ByteSpan bytes,
    const std::function<Status(std::uint8_t opcode, ByteSpan content, std::size_t offset)>& visit);

}  // namespace waymark::mcap
