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

/// A file as it grows, with its position and the checksum of its data section.
class Output {
 public:
  explicit Output(std::unique_ptr<ByteSink> sink) : sink_(std::move(sink)) {}

  [[nodiscard]] std::uint64_t position() const { return position_; }

  /// Appends bytes; position and checksum move only when all of them were taken.
  Status put(ByteSpan bytes) { return put(bytes, crc32(bytes)); }
  /// The same with their checksum, where it is known.
  Status put(ByteSpan bytes, std::uint32_t crc) {
    if (Status status = sink_->write(bytes); !status) return status;
    position_ += bytes.size();
    crc_ = crc32_of_both(crc_, crc, bytes.size());
    return {};
  }
  Status sync() { return sink_->sync(); }
  /// The end of the data section, and the summary.
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
  std::size_t chunk_size_bytes = 1 << 20;  ///< a chunk ends when it holds this much
  Duration chunk_duration =
      std::chrono::seconds(1);  ///< … or spans this much log time: what a crash can lose
  /// Sync each chunk_duration of log time, so that a power cut loses no more either.
  bool durable = false;
  bool chunked = true;        ///< false: each message by itself, unpacked and without an index
  bool message_index = true;  ///< where in a chunk the messages of each channel lie
  SummaryParts summary{};
};

/// Writes an MCAP file front to back ("MCAP Format Specification"): chunks with message indexes and CRCs,
/// then the summary. A file whose writer died before close() is whole up to its last chunk and can be read as
/// a stream. Once something could not be written (a full disk) nothing more is taken: every call gives that
/// error; what stands in the file is kept, and close() still ends it with a summary where that fits.
/// O(1) a message; memory: one chunk and an index entry for each chunk.
class Writer {
 public:
  static Result<Writer> open(std::unique_ptr<ByteSink> sink, const WriterOptions& options);
  ~Writer();
  Writer(Writer&&) noexcept;
  Writer& operator=(Writer&&) noexcept;

  /// Ids count from 1. The same name and data give the same id.
  Result<std::uint16_t> add_schema(const std::string& name, const std::string& encoding, ByteSpan data);
  /// schema_id 0: no schema.
  Result<std::uint16_t> add_channel(const std::string& topic, std::uint16_t schema_id,
                                    const std::string& message_encoding,
                                    const std::map<std::string, std::string>& metadata = {});
  /// Appends a message; its sequence number counts per channel. Times in nanoseconds.
  Status write(std::uint16_t channel_id, std::uint64_t log_time, std::uint64_t publish_time, ByteSpan data);
  /// Appends a message as it is.
  Status write(const Message& message);
  Status write_attachment(Attachment attachment);
  Status write_metadata(const Metadata& metadata);

  /// Ends the chunk: everything so far is in the file. Call it when a second passes without messages.
  Status flush();
  /// Ends the file with its summary. Nothing may be written after it.
  Status close();

  /// Of what is in the file; messages of the chunk that is being filled are not counted yet.
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
  std::optional<std::uint64_t> unsynced_since_;  ///< log time of the first message that no sync covers

  Bytes chunk_;                               ///< room for the head of a chunk, then its records
  std::vector<MessageIndex> chunk_messages_;  ///< of each channel
  std::uint64_t chunk_message_count_ = 0;
  std::uint64_t chunk_start_time_ = 0;
  std::uint64_t chunk_end_time_ = 0;
  Bytes packed_;  ///< kept for its memory
};

}  // namespace waymark::mcap
