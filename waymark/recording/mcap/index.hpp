#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/mcap/records.hpp"
#include "waymark/recording/mcap/stream.hpp"

namespace waymark::mcap {

/// A schema that owns its text.
struct StoredSchema {
  std::string name{};
  std::string encoding{};
  Bytes data{};
};

/// A message outside chunks.
struct LooseMessage {
  std::uint64_t log_time = 0;
  std::uint64_t offset = 0;  ///< offset of the record in the file
  std::uint64_t length = 0;  ///< length of the whole record
};

/// Contents and offsets of a file, from its summary or, if it has none, from one pass over the file.
struct Index {
  Header header{};
  std::map<std::uint16_t, StoredSchema> schemas{};
  std::map<std::uint16_t, Channel> channels{};
  std::vector<ChunkIndex> chunks{};   ///< in file order
  std::vector<LooseMessage> loose{};  ///< in file order; empty for files written in chunks
  std::vector<AttachmentIndex> attachments{};
  std::vector<MetadataIndex> metadata{};
  Statistics statistics{};
  bool from_summary = false;      ///< false if the writer did not finish or wrote no usable summary
  std::vector<Error> problems{};  ///< damage and truncation
};

/// Reads a file's index. O(summary) if the summary suffices to find all messages, otherwise one pass over the
/// file. Memory: the summary, or an entry for each chunk (and for each message outside chunks).
[[nodiscard]] Result<Index> read_index(const ByteSource& source, const ReaderOptions& options = {});

/// Groups of records in a summary; only tests of readers omit any of them.
struct SummaryParts {
  bool schemas = true;
  bool channels = true;
  bool statistics = true;
  bool chunk_indexes = true;
  bool attachment_indexes = true;
  bool metadata_indexes = true;
  bool offsets = true;
};

/// Encodes the end of a file from `position` on: the summary of an index, the footer and the magic.
[[nodiscard]] Bytes encode_summary(const Index& index, std::uint64_t position,
                                   const SummaryParts& parts = {});

// Shared by the readers, the writer and the recovery of MCAP files.

/// Builds an index from the records of a data section in one pass.
class Scan {
 public:
  explicit Scan(Index& index) : index_(index) {}

  /// Adds a record at view.offset. A record that cannot be decoded is added to the problems.
  void add(const RecordView& view);
  /// Sets the counts of schemas, channels, attachments and metadata.
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

/// Adds one message to the statistics.
void count_message(Statistics& statistics, std::uint16_t channel_id, std::uint64_t log_time);

/// Reads the content of the record at an offset into `room`; the record's kind and length must match the
/// index.
[[nodiscard]] Result<ByteSpan> read_content(const ByteSource& source, std::uint64_t offset,
                                            std::uint64_t length, Opcode opcode, const ReaderOptions& options,
                                            Bytes& room);

}  // namespace waymark::mcap
