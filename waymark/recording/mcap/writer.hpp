#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/compression.hpp"
#include "waymark/recording/mcap/index.hpp"
#include "waymark/recording/mcap/records.hpp"

namespace waymark::mcap {

/// A file being written, with its position and the checksum of its data section.
class Output {
 public:
  explicit Output(std::unique_ptr<ByteSink> sink) : sink_(std::move(sink)) {}

  [[nodiscard]] std::uint64_t position() const { return position_; }

  /// Appends bytes; position and checksum advance only if all of them were accepted.
  Status put(ByteSpan bytes) { return put(bytes, crc32(bytes)); }
  /// Appends bytes with a checksum that is already known.
  Status put(ByteSpan bytes, std::uint32_t crc) {
    if (Status status = sink_->write(bytes); !status) return status;
    position_ += bytes.size();
    crc_ = crc32_of_both(crc_, crc, bytes.size());
    return {};
  }
  Status sync() { return sink_->sync(); }
  /// Writes the end of the data section and the summary.
  Status finish(const Index& index, const SummaryParts& parts = {}) {
    Bytes bytes;
    encode(bytes, DataEnd{.data_section_crc = crc_});
    append(bytes, encode_summary(index, position_ + bytes.size(), parts));
    return sink_->write(bytes);
  }

 private:
  std::unique_ptr<ByteSink> sink_;
  std::uint64_t position_ = 0;
  std::uint32_t crc_ = 0;
};

struct WriterOptions {
  std::string profile = "ros2";
  std::string library = "waymark";
  Compression compression = Compression::Zstd;
  std::size_t chunk_size_bytes = 1 << 20;  ///< a chunk ends once it reaches this size
  Duration chunk_duration =
      std::chrono::seconds(1);  ///< … or this span of log time, which bounds the loss in a crash
  /// Syncs after each chunk_duration of log time, so that a power cut loses no more data than a crash.
  bool durable = false;
  bool chunked = true;        ///< if false, messages are outside chunks, uncompressed and without an index
  bool message_index = true;  ///< stores the offsets of each channel's messages in a chunk
  SummaryParts summary{};
};

/// Writes an MCAP file sequentially ("MCAP Format Specification"): chunks with message indexes and CRCs, then
/// the summary. A file whose writer crashed before close() is complete up to its last chunk and can be read
/// as a stream. After a write error (a full disk), every later call returns that error; the data already in
/// the file are kept, and close() still writes a summary if it fits. O(1) per message; holds one chunk and an
/// index entry per chunk in memory.
class Writer {
 public:
  static Result<Writer> open(std::unique_ptr<ByteSink> sink, const WriterOptions& options);
  ~Writer();
  Writer(Writer&&) noexcept;
  Writer& operator=(Writer&&) noexcept;

  /// Ids count from 1. If a schema with the same name and data exists, its id is returned.
  Result<std::uint16_t> add_schema(const std::string& name, const std::string& encoding, ByteSpan data);
  /// A schema_id of 0 means no schema.
  Result<std::uint16_t> add_channel(const std::string& topic, std::uint16_t schema_id,
                                    const std::string& message_encoding,
                                    const std::map<std::string, std::string>& metadata = {});
  /// Appends a message with its channel's next sequence number. Times are in nanoseconds.
  Status write(std::uint16_t channel_id, std::uint64_t log_time, std::uint64_t publish_time, ByteSpan data);
  /// Appends a message unchanged.
  Status write(const Message& message);
  Status write_attachment(Attachment attachment);
  Status write_metadata(const Metadata& metadata);

  /// Ends the chunk, so that all messages so far are in the file. Call this if no message arrives for a
  /// second.
  Status flush();
  /// Completes the file with its summary. write() must not be called afterwards.
  Status close();

  /// Statistics of the file, without the messages in the current chunk.
  [[nodiscard]] const Statistics& statistics() const { return index_.statistics; }

 private:
  Writer(std::unique_ptr<ByteSink> sink, const WriterOptions& options);

  template <class Record>
  Status append_to_chunk(const Record& record);
  Status put(ByteSpan bytes);
  Status put(ByteSpan bytes, std::uint32_t crc);
  Status put_chunk();
  Status put_loose();
  Status end_chunk();
  Status sync();
  [[nodiscard]] bool chunk_is_full(std::uint64_t log_time) const;
  [[nodiscard]] bool sync_is_due(std::uint64_t log_time) const;
  void index_message(const Message& message);
  void count_messages();
  [[nodiscard]] std::size_t chunk_head_size() const;
  [[nodiscard]] std::uint64_t chunk_ns() const {
    return static_cast<std::uint64_t>(options_.chunk_duration.count());
  }

  std::unique_ptr<Output> output_;
  WriterOptions options_;
  Index index_;
  std::vector<std::uint32_t> sequences_;
  std::optional<Error> failure_;
  std::optional<std::uint64_t> unsynced_since_;  ///< log time of the first unsynced message

  Bytes chunk_;                               ///< space for the head of a chunk, followed by its records
  std::vector<MessageIndex> chunk_messages_;  ///< one index per channel
  std::uint64_t chunk_message_count_ = 0;
  std::uint64_t chunk_start_time_ = 0;
  std::uint64_t chunk_end_time_ = 0;
  Bytes packed_;  ///< kept to reuse its memory
};

}  // namespace waymark::mcap
