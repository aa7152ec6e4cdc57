#include "waymark/recording/mcap/writer.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "waymark/recording/mcap/index.hpp"

namespace waymark::mcap {
namespace {

constexpr std::size_t kMaxIds = std::numeric_limits<std::uint16_t>::max();

tl::unexpected<Error> too_many(std::string_view what) {
  return fail(ErrorCode::LimitExceeded, fmt::format("an MCAP file holds at most {} {}", kMaxIds, what));
}

/// Encodes the opcode, length and fields of a chunk record that precede its records.
void encode_chunk_head(Bytes& out, const Chunk& chunk, std::uint64_t records_size) {
  const std::size_t at = out.size();
  encode(out, chunk);  // encoded without records; the last eight bytes are their size
  const std::uint64_t fields = out.size() - at - kRecordPrefixSize;
  put_little_endian(out.data() + at + 1, fields + records_size);
  put_little_endian(out.data() + out.size() - sizeof(records_size), records_size);
}

/// encode() specialised for messages, with only two appends.
void encode_message(Bytes& out, const Message& message) {
  std::uint8_t head[kRecordPrefixSize + 22];
  head[0] = static_cast<std::uint8_t>(Opcode::Message);
  put_little_endian(head + 1, static_cast<std::uint64_t>(22 + message.data.bytes.size()));
  put_little_endian(head + 9, message.channel_id);
  put_little_endian(head + 11, message.sequence);
  put_little_endian(head + 15, message.log_time);
  put_little_endian(head + 23, message.publish_time);
  append(out, head);
  append(out, message.data.bytes);
}

/// The CRC of an uncompressed chunk and its indexes, combined from the known CRC of the records.
std::uint32_t crc_of_unpacked(ByteSpan head, const Chunk& chunk, ByteSpan whole) {
  const ByteSpan indexes = whole.subspan(head.size() + static_cast<std::size_t>(chunk.uncompressed_size));
  const std::uint32_t begin = crc32_of_both(crc32(head), chunk.uncompressed_crc, chunk.uncompressed_size);
  return crc32_of_both(begin, crc32(indexes), indexes.size());
}

}  // namespace

Writer::Writer(std::unique_ptr<ByteSink> sink, const WriterOptions& options)
    : output_(std::make_unique<Output>(std::move(sink))), options_(options) {
  chunk_.resize(chunk_head_size());
}
Writer::~Writer() = default;
Writer::Writer(Writer&&) noexcept = default;
Writer& Writer::operator=(Writer&&) noexcept = default;

Result<Writer> Writer::open(std::unique_ptr<ByteSink> sink, const WriterOptions& options) {
  Writer writer(std::move(sink), options);
  Bytes bytes(std::begin(kMagic), std::end(kMagic));
  encode(bytes, Header{.profile = options.profile, .library = options.library});
  if (Status status = writer.put(bytes); !status) return tl::unexpected(status.error());
  return writer;
}

std::size_t Writer::chunk_head_size() const {
  return kRecordPrefixSize + 3 * sizeof(std::uint64_t) + sizeof(std::uint32_t) + sizeof(std::uint32_t) +
         to_string(options_.compression).size() + sizeof(std::uint64_t);
}

Status Writer::put(ByteSpan bytes) { return put(bytes, crc32(bytes)); }

Status Writer::put(ByteSpan bytes, std::uint32_t crc) {
  if (failure_) return tl::unexpected(*failure_);
  Status status = output_->put(bytes, crc);
  if (!status) failure_ = status.error();
  return status;
}

template <class Record>
Status Writer::append_to_chunk(const Record& record) {
  if (failure_) return tl::unexpected(*failure_);
  encode(chunk_, record);
  return options_.chunked ? Status{} : end_chunk();
}

Result<std::uint16_t> Writer::add_schema(const std::string& name, const std::string& encoding,
                                         ByteSpan data) {
  for (const auto& [id, schema] : index_.schemas) {
    if (schema.name == name && schema.encoding == encoding && std::ranges::equal(schema.data, data))
      return id;
  }
  if (index_.schemas.size() >= kMaxIds) return too_many("schemas");
  const auto id = static_cast<std::uint16_t>(index_.schemas.size() + 1);
  index_.schemas[id] = {name, encoding, Bytes(data.begin(), data.end())};
  Status status = append_to_chunk(Schema{.id = id, .name = name, .encoding = encoding, .data = {data}});
  if (!status) return tl::unexpected(status.error());
  return id;
}

Result<std::uint16_t> Writer::add_channel(const std::string& topic, std::uint16_t schema_id,
                                          const std::string& message_encoding,
                                          const std::map<std::string, std::string>& metadata) {
  if (schema_id > index_.schemas.size()) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("channel '{}' refers to schema {}, which was not added", topic, schema_id));
  }
  if (index_.channels.size() >= kMaxIds) return too_many("channels");
  const auto id = static_cast<std::uint16_t>(index_.channels.size() + 1);
  const Channel& channel = index_.channels[id] = {.id = id,
                                                  .schema_id = schema_id,
                                                  .topic = topic,
                                                  .message_encoding = message_encoding,
                                                  .metadata = metadata};
  sequences_.push_back(0);
  chunk_messages_.push_back({.channel_id = id});
  if (Status status = append_to_chunk(channel); !status) return tl::unexpected(status.error());
  return id;
}

bool Writer::chunk_is_full(std::uint64_t log_time) const {
  if (chunk_message_count_ == 0) return false;
  const std::uint64_t first = std::min(log_time, chunk_start_time_);
  const std::uint64_t last = std::max(log_time, chunk_end_time_);
  return chunk_.size() >= options_.chunk_size_bytes || last - first >= chunk_ns() || sync_is_due(log_time);
}

bool Writer::sync_is_due(std::uint64_t log_time) const {
  return options_.durable && unsynced_since_ && log_time > *unsynced_since_ &&
         log_time - *unsynced_since_ >= chunk_ns();
}

Status Writer::write(std::uint16_t channel_id, std::uint64_t log_time, std::uint64_t publish_time,
                     ByteSpan data) {
  const bool known = channel_id > 0 && channel_id <= sequences_.size();
  return write({.channel_id = channel_id,
                .sequence = known ? sequences_[channel_id - 1U]++ : 0,
                .log_time = log_time,
                .publish_time = publish_time,
                .data = {data}});
}

Status Writer::write(const Message& message) {
  if (message.channel_id == 0 || message.channel_id > index_.channels.size()) {
    return fail(ErrorCode::InvalidArgument, fmt::format("channel {} was not added", message.channel_id));
  }
  if (failure_) return tl::unexpected(*failure_);
  if (chunk_is_full(message.log_time)) {
    if (Status status = end_chunk(); !status) return status;
  }
  if (sync_is_due(message.log_time)) {
    if (Status status = sync(); !status) return status;
  }
  index_message(message);
  encode_message(chunk_, message);
  return options_.chunked ? Status{} : end_chunk();
}

void Writer::index_message(const Message& message) {
  const std::uint64_t log_time = message.log_time;
  if (!unsynced_since_) unsynced_since_ = log_time;
  const bool first_of_chunk = chunk_message_count_++ == 0;
  chunk_start_time_ = first_of_chunk ? log_time : std::min(chunk_start_time_, log_time);
  chunk_end_time_ = first_of_chunk ? log_time : std::max(chunk_end_time_, log_time);
  chunk_messages_[message.channel_id - 1U].records.emplace_back(log_time, chunk_.size() - chunk_head_size());
}

Status Writer::end_chunk() {
  if (failure_) return tl::unexpected(*failure_);
  const std::size_t head = chunk_head_size();
  if (chunk_.size() == head) return {};
  const Status status = options_.chunked ? put_chunk() : put_loose();
  chunk_.resize(head);
  for (MessageIndex& messages : chunk_messages_) messages.records.clear();
  chunk_message_count_ = 0;
  chunk_start_time_ = chunk_end_time_ = 0;
  return status;
}

Status Writer::put_loose() {
  Status status = put(ByteSpan(chunk_).subspan(chunk_head_size()));
  if (status) count_messages();
  return status;
}

void Writer::count_messages() {
  if (chunk_message_count_ == 0) return;
  Statistics& statistics = index_.statistics;
  const bool first = statistics.message_count == 0;
  statistics.message_start_time =
      first ? chunk_start_time_ : std::min(statistics.message_start_time, chunk_start_time_);
  statistics.message_end_time = std::max(statistics.message_end_time, chunk_end_time_);
  statistics.message_count += chunk_message_count_;
  for (const MessageIndex& messages : chunk_messages_) {
    if (!messages.records.empty())
      statistics.channel_message_counts[messages.channel_id] += messages.records.size();
  }
}

Status Writer::put_chunk() {
  const std::size_t head = chunk_head_size();
  const ByteSpan records = ByteSpan(chunk_).subspan(head);
  const Chunk chunk{.message_start_time = chunk_start_time_,
                    .message_end_time = chunk_end_time_,
                    .uncompressed_size = records.size(),
                    .uncompressed_crc = crc32(records),
                    .compression = std::string(to_string(options_.compression))};
  ChunkIndex entry{.message_start_time = chunk_start_time_,
                   .message_end_time = chunk_end_time_,
                   .chunk_start_offset = output_->position(),
                   .compression = chunk.compression,
                   .uncompressed_size = records.size()};
  const bool packs = options_.compression != Compression::None;
  Bytes& out = packs ? packed_ : chunk_;
  if (packs) {
    packed_.resize(head);
    Status status = compress(options_.compression, records, packed_);
    if (!status) return status;
  }
  entry.chunk_length = out.size();
  entry.compressed_size = out.size() - head;
  Bytes chunk_head;
  encode_chunk_head(chunk_head, chunk, entry.compressed_size);
  std::ranges::copy(chunk_head, out.begin());
  if (options_.message_index) {
    for (const MessageIndex& messages : chunk_messages_) {
      if (messages.records.empty()) continue;
      entry.message_index_offsets[messages.channel_id] = entry.chunk_start_offset + out.size();
      encode(out, messages);
    }
  }
  entry.message_index_length = out.size() - entry.chunk_length;
  // The chunk and its indexes are written in one call, so a killed process leaves either all of them or a
  // tail that readers recognise.
  const std::uint32_t crc = packs ? crc32(out) : crc_of_unpacked(chunk_head, chunk, out);
  if (Status status = put(out, crc); !status) return status;
  index_.chunks.push_back(std::move(entry));
  ++index_.statistics.chunk_count;
  count_messages();
  return {};
}

Status Writer::sync() {
  if (failure_) return tl::unexpected(*failure_);
  Status status = output_->sync();
  if (!status) failure_ = status.error();
  unsynced_since_.reset();
  return status;
}

Status Writer::flush() {
  if (Status status = end_chunk(); !status) return status;
  return options_.durable ? sync() : Status{};
}

Status Writer::write_attachment(Attachment attachment) {
  if (Status status = end_chunk(); !status) return status;
  Bytes content;
  attachment.crc = 0;
  encode_content(content, attachment);
  attachment.crc = crc32(ByteSpan(content).first(content.size() - sizeof(attachment.crc)));
  Bytes bytes;
  encode(bytes, attachment);
  const AttachmentIndex entry{.offset = output_->position(),
                              .length = bytes.size(),
                              .log_time = attachment.log_time,
                              .create_time = attachment.create_time,
                              .data_size = attachment.data.bytes.size(),
                              .name = attachment.name,
                              .media_type = attachment.media_type};
  if (Status status = put(bytes); !status) return status;
  index_.attachments.push_back(entry);
  return options_.durable ? sync() : Status{};
}

Status Writer::write_metadata(const Metadata& metadata) {
  if (Status status = end_chunk(); !status) return status;
  Bytes bytes;
  encode(bytes, metadata);
  const MetadataIndex entry{.offset = output_->position(), .length = bytes.size(), .name = metadata.name};
  if (Status status = put(bytes); !status) return status;
  index_.metadata.push_back(entry);
  return options_.durable ? sync() : Status{};
}

Status Writer::close() {
  Status flushed = end_chunk();
  Scan(index_).finish();
  // Called even after a failure, because the data in the file still need an index if it fits.
  Status finished = output_->finish(index_, options_.summary);
  if (finished && options_.durable) finished = output_->sync();
  return flushed ? finished : flushed;
}

}  // namespace waymark::mcap
