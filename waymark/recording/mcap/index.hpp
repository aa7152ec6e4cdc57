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

/// A message that lies in no chunk.
struct LooseMessage {
  std::uint64_t log_time = 0;
  std::uint64_t offset = 0;  ///< of the record in the file
  std::uint64_t length = 0;  ///< of the whole record
};

/// What is in a file and where, from its summary or, when that is missing, from one pass over the file.
struct Index {
  Header header{};
  std::map<std::uint16_t, StoredSchema> schemas{};
  std::map<std::uint16_t, Channel> channels{};
  std::vector<ChunkIndex> chunks{};   ///< in file order
  std::vector<LooseMessage> loose{};  ///< in file order; a file written in chunks has none
  std::vector<AttachmentIndex> attachments{};
  std::vector<MetadataIndex> metadata{};
  Statistics statistics{};
  bool from_summary = false;      ///< false: the writer did not finish, or wrote no usable summary
  std::vector<Error> problems{};  ///< what was damaged or cut
};

/// The index of a file. O(summary) when there is one that suffices for finding messages, else one pass over
/// the file. Memory: the summary, or an entry for each chunk (and for each message outside chunks).
[[nodiscard]] Result<Index> read_index(const ByteSource& source, const ReaderOptions& options = {});

/// Which groups of records a summary holds; all but for a reader that is to be tested without.
struct SummaryParts {
  bool schemas = true;
  bool channels = true;
  bool statistics = true;
  bool chunk_indexes = true;
  bool attachment_indexes = true;
  bool metadata_indexes = true;
  bool offsets = true;
};

/// The end of a file from `position` on: the summary of an index, the footer and the magic.
[[nodiscard]] Bytes encode_summary(const Index& index, std::uint64_t position,
                                   const SummaryParts& parts = {});

// What the readers, the writer and the recovery of MCAP files share:

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

/// Counts one message more.
void count_message(Statistics& statistics, std::uint16_t channel_id, std::uint64_t log_time);

/// Content of the record at an offset, of the kind and length an index promises; it lies in `room`.
[[nodiscard]] Result<ByteSpan> read_content(const ByteSource& source, std::uint64_t offset,
                                            std::uint64_t length, Opcode opcode, const ReaderOptions& options,
                                            Bytes& room);

}  // namespace waymark::mcap
