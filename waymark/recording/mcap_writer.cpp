#include "waymark/recording/mcap_writer.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

namespace waymark::mcap {
namespace {

constexpr std::size_t kMostIds = std::numeric_limits<std::uint16_t>::max();

tl::unexpected<Error> too_many(std::string_view what) {
  return fail(ErrorCode::LimitExceeded, fmt::format("an MCAP file holds at most {} {}", kMostIds, what));
}

}  // namespace

Result<Writer> Writer::open(std::unique_ptr<ByteSink> sink, const WriterOptions& options) {
  Writer writer(std::move(sink), options);
  Bytes bytes(std::begin(kMagic), std::end(kMagic));
  encode(bytes, Header{.profile = options.profile, .library = options.library});
  if (Status status = writer.put(bytes); !status) return tl::unexpected(status.error());
  return writer;
}

Status Writer::put(ByteSpan bytes) {
  position_ += bytes.size();
  data_crc_ = crc32(bytes, data_crc_);
  return sink_->write(bytes);
}

Result<std::uint16_t> Writer::add_schema(const std::string& name, const std::string& encoding,
                                         ByteSpan data) {
  for (std::size_t i = 0; i < schemas_.size(); ++i) {
    if (schemas_[i].name == name && std::ranges::equal(schema_data_[i], data)) return schemas_[i].id;
  }
  if (schemas_.size() >= kMostIds) return too_many("schemas");
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  schema_data_.emplace_back(data.begin(), data.end());
  schemas_.push_back({.id = id, .name = name, .encoding = encoding, .data = {schema_data_.back()}});
  encode(chunk_, schemas_.back());
  return id;
}

Result<std::uint16_t> Writer::add_channel(const std::string& topic, std::uint16_t schema_id,
                                          const std::string& message_encoding,
                                          const std::map<std::string, std::string>& metadata) {
  if (schema_id > schemas_.size()) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("channel '{}' names schema {}, which was not added", topic, schema_id));
  }
  if (channels_.size() >= kMostIds) return too_many("channels");
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  channels_.push_back({.id = id,
                       .schema_id = schema_id,
                       .topic = topic,
                       .message_encoding = message_encoding,
                       .metadata = metadata});
  sequences_.push_back(0);
  encode(chunk_, channels_.back());
  return id;
}

bool Writer::chunk_is_full(std::uint64_t log_time) const {
  if (chunk_messages_.empty()) return false;
  const std::uint64_t first = std::min(log_time, chunk_start_time_);
  const std::uint64_t last = std::max(log_time, chunk_end_time_);
  return chunk_.size() >= options_.chunk_size_bytes ||
         last - first >= static_cast<std::uint64_t>(options_.chunk_duration.count());
}

Status Writer::write(std::uint16_t channel_id, std::uint64_t log_time, std::uint64_t publish_time,
                     ByteSpan data) {
  if (channel_id == 0 || channel_id > channels_.size()) {
    return fail(ErrorCode::InvalidArgument, fmt::format("channel {} was not added", channel_id));
  }
  if (chunk_is_full(log_time)) {
    if (Status status = flush(); !status) return status;
  }
  index_message(channel_id, log_time);
  encode(chunk_, Message{.channel_id = channel_id,
                         .sequence = sequences_[channel_id - 1U]++,
                         .log_time = log_time,
                         .publish_time = publish_time,
                         .data = {data}});
  return {};
}

void Writer::index_message(std::uint16_t channel_id, std::uint64_t log_time) {
  const bool first_of_chunk = chunk_messages_.empty();
  chunk_start_time_ = first_of_chunk ? log_time : std::min(chunk_start_time_, log_time);
  chunk_end_time_ = first_of_chunk ? log_time : std::max(chunk_end_time_, log_time);
  MessageIndex& index = chunk_messages_[channel_id];
  index.channel_id = channel_id;
  index.records.emplace_back(log_time, chunk_.size());

  const bool first = statistics_.message_count == 0;
  statistics_.message_start_time = first ? log_time : std::min(statistics_.message_start_time, log_time);
  statistics_.message_end_time = first ? log_time : std::max(statistics_.message_end_time, log_time);
  ++statistics_.message_count;
  ++statistics_.channel_message_counts[channel_id];
}

Status Writer::flush() {
  if (chunk_.empty()) return {};
  Result<Bytes> packed = compress(options_.compression, chunk_);
  if (!packed) return tl::unexpected(packed.error());
  const Chunk chunk{.message_start_time = chunk_start_time_,
                    .message_end_time = chunk_end_time_,
                    .uncompressed_size = chunk_.size(),
                    .uncompressed_crc = crc32(chunk_),
                    .compression = std::string(to_string(options_.compression)),
                    .records = {*packed}};
  Bytes bytes;
  encode(bytes, chunk);
  ChunkIndex index{.message_start_time = chunk_start_time_,
                   .message_end_time = chunk_end_time_,
                   .chunk_start_offset = position_,
                   .chunk_length = bytes.size(),
                   .compression = chunk.compression,
                   .compressed_size = packed->size(),
                   .uncompressed_size = chunk_.size()};
  for (auto& [channel_id, messages] : chunk_messages_) {
    std::ranges::stable_sort(messages.records, {}, [](const auto& entry) { return entry.first; });
    index.message_index_offsets[channel_id] = position_ + bytes.size();
    encode(bytes, messages);
  }
  index.message_index_length = bytes.size() - index.chunk_length;
  chunk_indexes_.push_back(std::move(index));
  ++statistics_.chunk_count;
  chunk_.clear();
  chunk_messages_.clear();
  chunk_start_time_ = chunk_end_time_ = 0;
  // Chunk and indexes in one write: a kill leaves either all of it or a tail that readers recognise.
  if (Status status = put(bytes); !status) return status;
  return options_.durable ? sink_->sync() : Status{};
}

Status Writer::write_attachment(Attachment attachment) {
  if (Status status = flush(); !status) return status;
  Bytes content;
  attachment.crc = 0;
  encode_content(content, attachment);
  attachment.crc = crc32(ByteSpan(content).first(content.size() - sizeof(attachment.crc)));
  Bytes bytes;
  encode(bytes, attachment);
  attachment_indexes_.push_back({.offset = position_,
                                 .length = bytes.size(),
                                 .log_time = attachment.log_time,
                                 .create_time = attachment.create_time,
                                 .data_size = attachment.data.bytes.size(),
                                 .name = attachment.name,
                                 .media_type = attachment.media_type});
  ++statistics_.attachment_count;
  return put(bytes);
}

Status Writer::write_metadata(const Metadata& metadata) {
  if (Status status = flush(); !status) return status;
  Bytes bytes;
  encode(bytes, metadata);
  metadata_indexes_.push_back({.offset = position_, .length = bytes.size(), .name = metadata.name});
  ++statistics_.metadata_count;
  return put(bytes);
}

Bytes Writer::encode_summary() const {
  Bytes summary;
  std::vector<SummaryOffset> offsets;
  const auto group = [&](Opcode opcode, const auto& records) {
    const std::size_t start = summary.size();
    for (const auto& record : records) encode(summary, record);
    if (summary.size() > start) {
      offsets.push_back({.group_opcode = static_cast<std::uint8_t>(opcode),
                         .group_start = position_ + start,
                         .group_length = summary.size() - start});
    }
  };
  group(Opcode::Schema, schemas_);
  group(Opcode::Channel, channels_);
  group(Opcode::Statistics, std::vector{statistics_});
  group(Opcode::ChunkIndex, chunk_indexes_);
  group(Opcode::AttachmentIndex, attachment_indexes_);
  group(Opcode::MetadataIndex, metadata_indexes_);
  Footer footer{.summary_start = position_, .summary_offset_start = position_ + summary.size()};
  for (const SummaryOffset& offset : offsets) encode(summary, offset);
  // The CRC covers the summary and the footer up to the CRC itself.
  encode(summary, footer);
  footer.summary_crc = crc32(ByteSpan(summary).first(summary.size() - sizeof(footer.summary_crc)));
  summary.resize(summary.size() - sizeof(footer.summary_crc));
  append_little_endian(summary, footer.summary_crc);
  return summary;
}

Status Writer::close() {
  if (Status status = flush(); !status) return status;
  statistics_.schema_count = static_cast<std::uint16_t>(schemas_.size());
  statistics_.channel_count = static_cast<std::uint32_t>(channels_.size());
  Bytes bytes;
  encode(bytes, DataEnd{.data_section_crc = data_crc_});
  if (Status status = put(bytes); !status) return status;
  bytes = encode_summary();
  append(bytes, kMagic);
  if (Status status = put(bytes); !status) return status;
  return options_.durable ? sink_->sync() : Status{};
}

}  // namespace waymark::mcap
