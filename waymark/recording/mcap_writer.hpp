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
#include "waymark/recording/mcap_records.hpp"

namespace waymark::mcap {

struct WriterOptions {
  std::string profile = "ros2";
  std::string library = "waymark";
  Compression compression = Compression::Zstd;
  std::size_t chunk_size_bytes = 1 << 20;  ///< a chunk ends when it holds this much
  Duration chunk_duration =
      std::chrono::seconds(1);  ///< … or spans this much log time: what a crash can lose
  bool durable = false;         ///< sync after each chunk, so that a power cut loses no more either
};

/// Writes an MCAP file front to back ("MCAP Format Specification"): chunks with message indexes and CRCs,
/// then the summary. A file whose writer died before close() is whole up to its last chunk and can be read as
/// a stream. O(1) a message; memory: one chunk and an index entry for each chunk.
class Writer {
 public:
  static Result<Writer> open(std::unique_ptr<ByteSink> sink, const WriterOptions& options);

  /// Ids count from 1. The same name and data give the same id.
  Result<std::uint16_t> add_schema(const std::string& name, const std::string& encoding, ByteSpan data);
  /// schema_id 0: no schema.
  Result<std::uint16_t> add_channel(const std::string& topic, std::uint16_t schema_id,
                                    const std::string& message_encoding,
                                    const std::map<std::string, std::string>& metadata = {});
  /// Appends a message; its sequence number counts per channel. Times in nanoseconds.
  Status write(std::uint16_t channel_id, std::uint64_t log_time, std::uint64_t publish_time, ByteSpan data);
  Status write_attachment(Attachment attachment);
  Status write_metadata(const Metadata& metadata);

  /// Ends the chunk: everything so far is in the file. Call it when a second passes without messages.
  Status flush();
  /// Ends the file with its summary. Nothing may be written after it.
  Status close();

  [[nodiscard]] const Statistics& statistics() const { return statistics_; }

 private:
  explicit Writer(std::unique_ptr<ByteSink> sink, const WriterOptions& options)
      : sink_(std::move(sink)), options_(options) {}

  Status put(ByteSpan bytes);
  void index_message(std::uint16_t channel_id, std::uint64_t log_time);
  [[nodiscard]] bool chunk_is_full(std::uint64_t log_time) const;
  [[nodiscard]] Bytes encode_summary() const;

  std::unique_ptr<ByteSink> sink_;
  WriterOptions options_;
  std::uint64_t position_ = 0;
  std::uint32_t data_crc_ = 0;

  std::vector<Schema> schemas_;
  std::vector<Bytes> schema_data_;
  std::vector<Channel> channels_;
  std::vector<std::uint32_t> sequences_;
  std::vector<ChunkIndex> chunk_indexes_;
  std::vector<AttachmentIndex> attachment_indexes_;
  std::vector<MetadataIndex> metadata_indexes_;
  Statistics statistics_;

  Bytes chunk_;
  std::map<std::uint16_t, MessageIndex> chunk_messages_;
  std::uint64_t chunk_start_time_ = 0;
  std::uint64_t chunk_end_time_ = 0;
};

}  // namespace waymark::mcap
