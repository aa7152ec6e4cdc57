#pragma once
// Inside the room: what the readers, the writer and the recovery of MCAP files share.

#include <cstdint>

#include "waymark/recording/mcap_index.hpp"

namespace waymark::mcap {

template <class Record>
[[nodiscard]] bool is(std::uint8_t opcode) {
  return opcode == static_cast<std::uint8_t>(Record::kOpcode);
}

[[nodiscard]] inline Place at(const ByteSource& source, std::uint64_t offset) {
  return {.source = source.name(), .byte = static_cast<std::int64_t>(offset)};
}

/// Counts and files the records of a data section in an index, as one pass over it shows them.
class Scan {
 public:
  explicit Scan(Index& index) : index_(index) {}

  /// A record at view.offset. One that does not decode is noted among the problems.
  void add(const RecordView& view);
  /// Fills in the counts of schemas, channels, attachments and metadata.
  void finish();

 private:
  Status on_schema(const RecordView& view);
  Status on_channel(const RecordView& view);
  Status on_chunk(const RecordView& view);
  Status on_message(const RecordView& view);
  Status on_attachment(const RecordView& view);
  Status on_metadata(const RecordView& view);

  Index& index_;
};

void count_message(Statistics& statistics, std::uint16_t channel_id, std::uint64_t log_time);

/// Content of the record at an offset, of the kind and length an index promises; it lies in `room`.
[[nodiscard]] Result<ByteSpan> read_content(const ByteSource& source, std::uint64_t offset,
                                            std::uint64_t length, Opcode opcode, const ReaderOptions& options,
                                            Bytes& room);

}  // namespace waymark::mcap
