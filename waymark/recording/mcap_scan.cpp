#include "waymark/recording/mcap_scan.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace waymark::mcap {
namespace {

/// Decodes a record and gives it to store.
template <class Record, class Store>
Status with(ByteSpan content, Store store) {
  Result<Record> record = decode<Record>(content);
  if (!record) return tl::unexpected(record.error());
  store(*record);
  return {};
}

std::uint64_t whole(const RecordView& view) { return kRecordPrefixSize + view.content.size(); }

}  // namespace

void count_message(Statistics& statistics, std::uint16_t channel_id, std::uint64_t log_time) {
  const bool first = statistics.message_count == 0;
  statistics.message_start_time = first ? log_time : std::min(statistics.message_start_time, log_time);
  statistics.message_end_time = first ? log_time : std::max(statistics.message_end_time, log_time);
  ++statistics.message_count;
  ++statistics.channel_message_counts[channel_id];
}

void Scan::add(const RecordView& view) {
  Status status;
  if (is<Message>(view.opcode)) status = on_message(view);
  if (is<Schema>(view.opcode)) status = on_schema(view);
  if (is<Channel>(view.opcode)) status = on_channel(view);
  if (is<Chunk>(view.opcode)) status = on_chunk(view);
  if (is<Attachment>(view.opcode)) status = on_attachment(view);
  if (is<Metadata>(view.opcode)) status = on_metadata(view);
  if (status) return;
  Error error = status.error();
  error.place.byte = static_cast<std::int64_t>(view.offset);
  index_.problems.push_back(std::move(error));
}

void Scan::finish() {
  Statistics& statistics = index_.statistics;
  statistics.schema_count = static_cast<std::uint16_t>(index_.schemas.size());
  statistics.channel_count = static_cast<std::uint32_t>(index_.channels.size());
  statistics.chunk_count = static_cast<std::uint32_t>(index_.chunks.size());
  statistics.attachment_count = static_cast<std::uint32_t>(index_.attachments.size());
  statistics.metadata_count = static_cast<std::uint32_t>(index_.metadata.size());
}

Status Scan::on_schema(const RecordView& view) {
  return with<Schema>(view.content, [&](const Schema& schema) {
    const ByteSpan data = schema.data.bytes;
    index_.schemas[schema.id] = {schema.name, schema.encoding, Bytes(data.begin(), data.end())};
  });
}

Status Scan::on_channel(const RecordView& view) {
  return with<Channel>(view.content, [&](const Channel& channel) { index_.channels[channel.id] = channel; });
}

Status Scan::on_chunk(const RecordView& view) {
  return with<Chunk>(view.content, [&](const Chunk& chunk) {
    index_.chunks.push_back({.message_start_time = chunk.message_start_time,
                             .message_end_time = chunk.message_end_time,
                             .chunk_start_offset = view.offset,
                             .chunk_length = whole(view),
                             .compression = chunk.compression,
                             .compressed_size = chunk.records.bytes.size(),
                             .uncompressed_size = chunk.uncompressed_size});
  });
}

Status Scan::on_message(const RecordView& view) {
  return with<Message>(view.content, [&](const Message& message) {
    count_message(index_.statistics, message.channel_id, message.log_time);
    if (!view.in_chunk) index_.loose.push_back({message.log_time, view.offset, whole(view)});
  });
}

Status Scan::on_attachment(const RecordView& view) {
  return with<Attachment>(view.content, [&](const Attachment& attachment) {
    index_.attachments.push_back({.offset = view.offset,
                                  .length = whole(view),
                                  .log_time = attachment.log_time,
                                  .create_time = attachment.create_time,
                                  .data_size = attachment.data.bytes.size(),
                                  .name = attachment.name,
                                  .media_type = attachment.media_type});
  });
}

Status Scan::on_metadata(const RecordView& view) {
  return with<Metadata>(view.content, [&](const Metadata& metadata) {
    index_.metadata.push_back({.offset = view.offset, .length = whole(view), .name = metadata.name});
  });
}

Result<ByteSpan> read_content(const ByteSource& source, std::uint64_t offset, std::uint64_t length,
                              Opcode opcode, const ReaderOptions& options, Bytes& room) {
  const Result<std::uint64_t> size = source.size();
  if (!size) return tl::unexpected(size.error());
  const bool inside = offset <= *size && length <= *size - offset;
  if (length < kRecordPrefixSize || length > options.max_record_bytes || !inside) {
    return fail(ErrorCode::LimitExceeded, fmt::format("a record of {} bytes is not plausible here", length),
                at(source, offset));
  }
  room.resize(static_cast<std::size_t>(length));
  if (Status status = source.read(offset, room); !status) return tl::unexpected(status.error());
  const bool as_promised = room[0] == static_cast<std::uint8_t>(opcode) &&
                           from_little_endian<std::uint64_t>(room.data() + 1) == length - kRecordPrefixSize;
  if (!as_promised) {
    return fail(ErrorCode::Unreadable, "the index points to something else", at(source, offset),
                "`waymark recover` makes a file with an index that is right.");
  }
  return ByteSpan(room).subspan(kRecordPrefixSize);
}

}  // namespace waymark::mcap
