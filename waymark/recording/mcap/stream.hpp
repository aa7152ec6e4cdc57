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

/// A byte of a file, for errors.
[[nodiscard]] inline Place at(const ByteSource& source, std::uint64_t offset) {
  return {.source = source.name(), .byte = static_cast<std::int64_t>(offset)};
}

struct ReaderOptions {
  /// Refuse a record or an unpacked chunk larger than this; a reader never holds more than two of them.
  std::uint64_t max_record_bytes = std::uint64_t{1} << 30;
  /// A file up to this size is compared with its checksum when it is opened, which reads all of it.
  std::uint64_t max_checked_bytes = std::uint64_t{1} << 32;
  /// read_index() takes the summary of a file whose first bytes are lost, too.
  bool begin_may_be_lost = false;
  /// Told of damage that a visit passes over; unless set, damage ends the visit with its error.
  std::function<void(const Error&)> on_damage{};
};

/// One record as it lies in the file; the content is gone after the callback returns.
struct RecordView {
  std::uint8_t opcode = 0;  ///< of enum Opcode, or one this version does not know: pass it over
  ByteSpan content{};
  std::uint64_t offset = 0;  ///< of the record in the file; inside a chunk, that of the chunk
  bool in_chunk = false;
  std::uint64_t inner_offset = 0;  ///< inside a chunk: of the record in the unpacked bytes
};

/// A record that an index names.
struct KnownRecord {
  std::uint64_t offset = 0;
  std::uint8_t opcode = 0;

  friend auto operator<=>(const KnownRecord&, const KnownRecord&) = default;
};

/// How reading front to back ended.
struct StreamSummary {
  bool complete = false;            ///< the closing magic was reached
  std::uint64_t good_bytes = 0;     ///< end of the last whole record: what recovery keeps
  std::uint64_t skipped_bytes = 0;  ///< in front of it: records that are damaged: of chunks their bytes, of
                                    ///< lengths all up to the next known record
  std::vector<Error>
      problems{};  ///< the cut at the end, chunks whose CRC or packing is wrong (they are passed over)
};

/// Reads all records front to back, those inside chunks included (behind their chunk's own record); a chunk
/// whose packing or CRC is wrong is not visited. Needs no index, so it works on a recording in progress or
/// one whose writer died. Fails only when it is not an MCAP file at all, or when the callback does; damage is
/// reported in the summary. Behind a record whose length or kind is damaged it goes on at the next of
/// `known`, the records that an index names, in order; where none is known and `search` says so, at the next
/// bytes that look like a chunk; so it begins where the file does not begin as an MCAP. Memory: one record
/// and one unpacked chunk.
[[nodiscard]] Result<StreamSummary> read_stream(const ByteSource& source, const ReaderOptions& options,
                                                const std::function<Status(const RecordView&)>& visit,
                                                const std::vector<KnownRecord>& known = {},
                                                bool search = false);

/// The records inside a chunk, unpacked (into `room`, unless they are not packed) and with the CRC checked.
[[nodiscard]] Result<ByteSpan> unpack_chunk(const Chunk& chunk, const ReaderOptions& options, Bytes& room);

/// Calls visit for each record in unpacked bytes (a chunk or a summary section). Fails on a record that is
/// cut short.
[[nodiscard]] Status visit_records(
    ByteSpan bytes,
    const std::function<Status(std::uint8_t opcode, ByteSpan content, std::size_t offset)>& visit);

}  // namespace waymark::mcap
