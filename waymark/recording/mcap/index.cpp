#include "waymark/recording/mcap/index.hpp"

#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include "waymark/recording/compression.hpp"

namespace waymark::mcap {
namespace {

constexpr std::size_t kFooterContent = 20;

/// Adds a summary record to the index.
Status file_summary_record(Index& index, std::uint8_t opcode, ByteSpan content, bool& has_statistics) {
  const auto keep = [&]<class Record>(Record& into) -> Status {
    Result<Record> record = decode<Record>(content);
    if (!record) return tl::unexpected(record.error());
    into = std::move(*record);
    return {};
  };
  if (is<ChunkIndex>(opcode)) return keep(index.chunks.emplace_back());
  if (is<AttachmentIndex>(opcode)) return keep(index.attachments.emplace_back());
  if (is<MetadataIndex>(opcode)) return keep(index.metadata.emplace_back());
  if (is<Statistics>(opcode)) {
    has_statistics = true;
    return keep(index.statistics);
  }
  if (is<Schema>(opcode) || is<Channel>(opcode)) Scan(index).add({.opcode = opcode, .content = content});
  return index.problems.empty() ? Status{} : tl::unexpected(index.problems.front());
}

/// The footer, if the file ends as a finished file does.
std::optional<Footer> read_footer(const ByteSource& source, std::uint64_t size) {
  constexpr std::uint64_t kFooterSize = kRecordPrefixSize + kFooterContent;
  constexpr std::uint64_t kTail = kFooterSize + sizeof(kMagic);
  if (size < sizeof(kMagic) + kTail) return std::nullopt;
  Bytes tail(kTail);
  if (!source.read(size - kTail, tail)) return std::nullopt;
  const ByteSpan bytes(tail);
  if (!std::ranges::equal(bytes.last(sizeof(kMagic)), kMagic) || !is<Footer>(bytes[0])) return std::nullopt;
  const Result<Footer> footer = decode<Footer>(bytes.subspan(kRecordPrefixSize, kFooterContent));
  const bool sound =
      footer && footer->summary_start >= sizeof(kMagic) && footer->summary_start <= size - kTail;
  return sound ? std::optional(*footer) : std::nullopt;
}

/// Whether every message can be found through the index; writers may omit any part of a summary.
bool suffices(const Index& index) {
  const Statistics& statistics = index.statistics;
  const bool schemas = std::ranges::all_of(index.channels, [&](const auto& channel) {
    return channel.second.schema_id == 0 || index.schemas.contains(channel.second.schema_id);
  });
  return schemas && statistics.channel_count == index.channels.size() &&
         statistics.chunk_count == index.chunks.size() &&
         statistics.attachment_count == index.attachments.size() &&
         statistics.metadata_count == index.metadata.size() &&
         (statistics.message_count == 0 || statistics.chunk_count > 0);
}

/// Reads the summary into the index. Returns false if it is missing, insufficient or damaged; `damage` then
/// contains the reason.
bool index_from_summary(const ByteSource& source, std::uint64_t size, const ReaderOptions& options,
                        const std::optional<Footer>& footer, Index& index, std::optional<Error>& damage) {
  if (!footer) return false;
  const std::uint64_t end = size - sizeof(kMagic);
  if (end - footer->summary_start > options.max_record_bytes) return false;
  Bytes summary(static_cast<std::size_t>(end - footer->summary_start));
  if (!source.read(footer->summary_start, summary)) return false;
  const ByteSpan covered = ByteSpan(summary).first(summary.size() - sizeof(footer->summary_crc));
  if (footer->summary_crc != 0 && crc32(covered) != footer->summary_crc) {
    damage = Error{ErrorCode::Unreadable,
                   "wrong summary checksum (CRC-32); the summary is ignored and the file is read from its "
                   "beginning",
                   at(source, footer->summary_start),
                   {}};
    return false;
  }
  bool has_statistics = false;
  const Status walked = visit_records(summary, [&](std::uint8_t opcode, ByteSpan content, std::size_t) {
    return file_summary_record(index, opcode, content, has_statistics);
  });
  return walked && has_statistics && suffices(index);
}

Result<Index> index_from_scan(const ByteSource& source, const ReaderOptions& options, Header header) {
  Index index{.header = std::move(header)};
  Scan scan(index);
  bool in_data = true;
  const auto visit = [&](const RecordView& view) {
    // Records after the data section repeat the summary, which has already been found unusable.
    in_data = in_data && !is<DataEnd>(view.opcode);
    if (in_data) scan.add(view);
    return Status{};
  };
  Result<StreamSummary> stream = read_stream(source, options, visit, {}, true);
  if (!stream) return tl::unexpected(stream.error());
  index.problems.insert(index.problems.end(), stream->problems.begin(), stream->problems.end());
  scan.finish();
  return index;
}

/// The checksum of the data section, as stored in the DataEnd record. 0 if the record contains none or does
/// not precede the summary.
std::uint32_t promised_data_crc(const ByteSource& source, std::uint64_t summary_start) {
  constexpr std::uint64_t kDataEndSize = kRecordPrefixSize + sizeof(std::uint32_t);
  if (summary_start < sizeof(kMagic) + kDataEndSize) return 0;
  Bytes record(kDataEndSize);
  if (!source.read(summary_start - kDataEndSize, record) || !is<DataEnd>(record[0])) return 0;
  const auto end = decode<DataEnd>(ByteSpan(record).subspan(kRecordPrefixSize));
  return end ? end->data_section_crc : 0;
}

/// Locates changed bytes in the data section that no chunk checksum covers. These are mainly metadata, which
/// may contain the tag size.
std::string changed_part(const ByteSource& source, const ReaderOptions& options) {
  std::string metadata;
  const auto stream = read_stream(source, options, [&](const RecordView& view) -> Status {
    if (is<Metadata>(view.opcode))
      metadata += fmt::format("{} byte {}", metadata.empty() ? "" : ",", view.offset);
    return {};
  });
  if (stream && !stream->problems.empty() && stream->problems.front().place.byte)
    return fmt::format("the record at byte {} is damaged", *stream->problems.front().place.byte);
  return metadata.empty() ? "outside of the chunks"
                          : "outside of the chunks, perhaps in the metadata at" + metadata;
}

/// Verifies the checksum of the data section, which includes the leading magic.
std::optional<Error> damage_of_data(const ByteSource& source, std::uint64_t summary_start,
                                    const ReaderOptions& options) {
  constexpr std::uint64_t kPiece = std::uint64_t{1} << 20U;
  const std::uint32_t promised = promised_data_crc(source, summary_start);
  if (promised == 0) return std::nullopt;
  const std::uint64_t end = summary_start - kRecordPrefixSize - sizeof(std::uint32_t);
  std::uint32_t crc = 0;
  Bytes piece;
  for (std::uint64_t at = 0; at < end; at += piece.size()) {
    piece.resize(static_cast<std::size_t>(std::min(kPiece, end - at)));
    if (Status status = source.read(at, piece); !status) return status.error();
    crc = crc32(piece, crc);
  }
  if (crc == promised) return std::nullopt;
  return Error{
      ErrorCode::Unreadable,
      "checksum (CRC-32) mismatch in the recording: bytes were changed or lost, " +
          changed_part(source, options),
      at(source, 0),
      "Copy the file again from its source. If the new copy has the same error, check its values: tag "
      "sizes, camera "
      "calibration, number of images."};
}

Result<Header> read_header(const ByteSource& source, const ReaderOptions& options) {
  // Reads only the first record; an error returned by the callback ends the pass.
  Header header;
  bool stopped = false;
  const Result<StreamSummary> begin = read_stream(source, options, [&](const RecordView& view) -> Status {
    const Result<Header> first = is<Header>(view.opcode) ? decode<Header>(view.content) : Header{};
    if (first) header = *first;
    stopped = true;
    return fail(ErrorCode::NotFound, "");
  });
  if (!begin && !stopped) return tl::unexpected(begin.error());
  return header;
}

}  // namespace

Result<Index> read_index(const ByteSource& source, const ReaderOptions& options) {
  const Result<std::uint64_t> size = source.size();
  if (!size) return tl::unexpected(size.error());
  Result<Header> header = read_header(source, options);
  if (!header && options.begin_may_be_lost) header = Header{};
  if (!header) return tl::unexpected(header.error());
  Index index{.header = *header, .from_summary = true};
  const std::optional<Footer> footer = read_footer(source, *size);
  std::optional<Error> damage;
  const bool summarised = index_from_summary(source, *size, options, footer, index, damage);
  Result<Index> read =
      summarised ? Result<Index>(std::move(index)) : index_from_scan(source, options, std::move(*header));
  if (!read) return read;
  if (damage) read->problems.insert(read->problems.begin(), *damage);
  if (footer && *size <= options.max_checked_bytes) {
    if (auto changed = damage_of_data(source, footer->summary_start, options))
      read->problems.push_back(*changed);
  }
  return read;
}

namespace {

/// Appends groups of records and notes the offset of each.
class Groups {
 public:
  explicit Groups(std::uint64_t position) : position_(position) {}

  template <class Records, class Encode>
  void add(Opcode opcode, const Records& records, Encode encode_record) {
    const std::size_t start = bytes.size();
    for (const auto& record : records) encode_record(record);
    if (bytes.size() == start) return;
    offsets.push_back({.group_opcode = static_cast<std::uint8_t>(opcode),
                       .group_start = position_ + start,
                       .group_length = bytes.size() - start});
  }
  template <class Records>
  void add(Opcode opcode, const Records& records) {
    add(opcode, records, [this](const auto& record) { encode(bytes, record); });
  }

  Bytes bytes{};
  std::vector<SummaryOffset> offsets{};

 private:
  std::uint64_t position_;
};

}  // namespace

Bytes encode_summary(const Index& index, std::uint64_t position, const SummaryParts& parts) {
  Groups groups(position);
  if (parts.schemas) {
    groups.add(Opcode::Schema, index.schemas, [&](const auto& entry) {
      const auto& [id, schema] = entry;
      encode(groups.bytes,
             Schema{.id = id, .name = schema.name, .encoding = schema.encoding, .data = {schema.data}});
    });
  }
  if (parts.channels) {
    groups.add(Opcode::Channel, index.channels,
               [&](const auto& entry) { encode(groups.bytes, entry.second); });
  }
  if (parts.statistics) groups.add(Opcode::Statistics, std::vector{index.statistics});
  if (parts.chunk_indexes) groups.add(Opcode::ChunkIndex, index.chunks);
  if (parts.attachment_indexes) groups.add(Opcode::AttachmentIndex, index.attachments);
  if (parts.metadata_indexes) groups.add(Opcode::MetadataIndex, index.metadata);
  Bytes& bytes = groups.bytes;
  Footer footer{.summary_start = bytes.empty() ? 0 : position};
  if (parts.offsets && !groups.offsets.empty()) {
    footer.summary_offset_start = position + bytes.size();
    for (const SummaryOffset& offset : groups.offsets) encode(bytes, offset);
  }
  // The CRC covers the summary and the footer up to its CRC field.
  encode(bytes, footer);
  bytes.resize(bytes.size() - sizeof(footer.summary_crc));
  append_little_endian(bytes, crc32(bytes));
  append(bytes, kMagic);
  return std::move(bytes);
}

namespace {

/// Decodes a record and passes it to `store`.
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
    return fail(ErrorCode::LimitExceeded, fmt::format("implausible record size of {} bytes", length),
                at(source, offset));
  }
  room.resize(static_cast<std::size_t>(length));
  if (Status status = source.read(offset, room); !status) return tl::unexpected(status.error());
  const bool as_promised = room[0] == static_cast<std::uint8_t>(opcode) &&
                           from_little_endian<std::uint64_t>(room.data() + 1) == length - kRecordPrefixSize;
  if (!as_promised) {
    return fail(ErrorCode::Unreadable, "the index does not match the record here", at(source, offset),
                "`waymark recover` writes a file with a correct index.");
  }
  return ByteSpan(room).subspan(kRecordPrefixSize);
}

}  // namespace waymark::mcap
