#include "waymark/recording/mcap_reader.hpp"

#include <algorithm>
#include <queue>

#include <fmt/format.h>

#include "waymark/recording/compression.hpp"

namespace waymark::mcap {
namespace {

Place at(const ByteSource& source, std::uint64_t offset) {
  return {.source = source.name(), .byte = static_cast<std::int64_t>(offset)};
}

template <class Record>
bool is(std::uint8_t opcode) {
  return opcode == static_cast<std::uint8_t>(Record::kOpcode);
}

/// Files a record of the summary (or of the data section, when there is no summary) in the index.
Status file_record(Index& index, std::uint8_t opcode, ByteSpan content) {
  const auto keep = [&]<class Record>(std::type_identity<Record>, auto store) -> Status {
    Result<Record> record = decode<Record>(content);
    if (!record) return tl::unexpected(record.error());
    store(std::move(*record));
    return {};
  };
  if (is<Schema>(opcode)) {
    return keep(std::type_identity<Schema>{}, [&](Schema schema) {
      const ByteSpan data = schema.data.bytes;
      index.schemas.insert_or_assign(
          schema.id,
          StoredSchema{std::move(schema.name), std::move(schema.encoding), Bytes(data.begin(), data.end())});
    });
  }
  if (is<Channel>(opcode)) {
    return keep(std::type_identity<Channel>{},
                [&](Channel channel) { index.channels.insert_or_assign(channel.id, std::move(channel)); });
  }
  if (is<ChunkIndex>(opcode)) {
    return keep(std::type_identity<ChunkIndex>{},
                [&](ChunkIndex chunk) { index.chunks.push_back(std::move(chunk)); });
  }
  if (is<AttachmentIndex>(opcode)) {
    return keep(std::type_identity<AttachmentIndex>{},
                [&](AttachmentIndex entry) { index.attachments.push_back(std::move(entry)); });
  }
  if (is<MetadataIndex>(opcode)) {
    return keep(std::type_identity<MetadataIndex>{},
                [&](MetadataIndex entry) { index.metadata.push_back(std::move(entry)); });
  }
  if (is<Statistics>(opcode)) {
    return keep(std::type_identity<Statistics>{},
                [&](Statistics statistics) { index.statistics = std::move(statistics); });
  }
  return {};
}

/// The footer, if the file ends as a finished one does.
std::optional<Footer> read_footer(const ByteSource& source, std::uint64_t size) {
  constexpr std::uint64_t kFooterSize = kRecordPrefixSize + 20;
  constexpr std::uint64_t kTail = kFooterSize + sizeof(kMagic);
  if (size < sizeof(kMagic) + kTail) return std::nullopt;
  Bytes tail(kTail);
  if (!source.read(size - kTail, tail)) return std::nullopt;
  const ByteSpan bytes(tail);
  if (!std::ranges::equal(bytes.last(sizeof(kMagic)), kMagic) || !is<Footer>(bytes[0])) return std::nullopt;
  const Result<Footer> footer = decode<Footer>(bytes.subspan(kRecordPrefixSize, 20));
  const bool sound =
      footer && footer->summary_start >= sizeof(kMagic) && footer->summary_start <= size - kTail;
  return sound ? std::optional(*footer) : std::nullopt;
}

/// Reads the summary into the index. False when there is none or it cannot be trusted.
bool index_from_summary(const ByteSource& source, std::uint64_t size, const ReaderOptions& options,
                        Index& index) {
  const std::optional<Footer> footer = read_footer(source, size);
  if (!footer) return false;
  const std::uint64_t end = size - sizeof(kMagic);
  if (end - footer->summary_start > options.max_record_bytes) return false;
  Bytes summary(static_cast<std::size_t>(end - footer->summary_start));
  if (!source.read(footer->summary_start, summary)) return false;
  const ByteSpan covered = ByteSpan(summary).first(summary.size() - sizeof(footer->summary_crc));
  if (footer->summary_crc != 0 && crc32(covered) != footer->summary_crc) return false;
  const Status walked = visit_records(summary, [&](std::uint8_t opcode, ByteSpan content, std::size_t) {
    return file_record(index, opcode, content);
  });
  // A summary without chunk indexes over chunks that hold messages is of no use for finding them.
  return walked && (index.statistics.chunk_count == index.chunks.size());
}

/// Counts and files what one pass over the data section shows.
class Scan {
 public:
  explicit Scan(Index& index) : index_(index) {}

  Status operator()(const RecordView& view) {
    if (is<Chunk>(view.opcode)) return on_chunk(view);
    if (is<Message>(view.opcode)) return on_message(view);
    if (is<Attachment>(view.opcode)) return on_attachment(view);
    if (is<Metadata>(view.opcode)) return on_metadata(view);
    // The file's own summary, if it comes at all, says nothing that this pass does not.
    const bool of_data = is<Schema>(view.opcode) || is<Channel>(view.opcode);
    return of_data ? file_record(index_, view.opcode, view.content) : Status{};
  }

 private:
  Status on_chunk(const RecordView& view) {
    const Result<Chunk> chunk = decode<Chunk>(view.content);
    if (!chunk) return {};  // read_stream() reports it
    index_.chunks.push_back({.message_start_time = chunk->message_start_time,
                             .message_end_time = chunk->message_end_time,
                             .chunk_start_offset = view.offset,
                             .chunk_length = kRecordPrefixSize + view.content.size(),
                             .compression = chunk->compression,
                             .compressed_size = chunk->records.bytes.size(),
                             .uncompressed_size = chunk->uncompressed_size});
    ++index_.statistics.chunk_count;
    return {};
  }

  Status on_message(const RecordView& view) {
    const Result<Message> message = decode<Message>(view.content);
    if (!message) return tl::unexpected(message.error());
    Statistics& statistics = index_.statistics;
    const bool first = statistics.message_count == 0;
    statistics.message_start_time =
        first ? message->log_time : std::min(statistics.message_start_time, message->log_time);
    statistics.message_end_time =
        first ? message->log_time : std::max(statistics.message_end_time, message->log_time);
    ++statistics.message_count;
    ++statistics.channel_message_counts[message->channel_id];
    return {};
  }

  Status on_attachment(const RecordView& view) {
    const Result<Attachment> attachment = decode<Attachment>(view.content);
    if (!attachment) return tl::unexpected(attachment.error());
    index_.attachments.push_back({.offset = view.offset,
                                  .length = kRecordPrefixSize + view.content.size(),
                                  .log_time = attachment->log_time,
                                  .create_time = attachment->create_time,
                                  .data_size = attachment->data.bytes.size(),
                                  .name = attachment->name,
                                  .media_type = attachment->media_type});
    return {};
  }

  Status on_metadata(const RecordView& view) {
    const Result<Metadata> metadata = decode<Metadata>(view.content);
    if (!metadata) return tl::unexpected(metadata.error());
    index_.metadata.push_back(
        {.offset = view.offset, .length = kRecordPrefixSize + view.content.size(), .name = metadata->name});
    return {};
  }

  Index& index_;
};

Result<Index> index_from_scan(const ByteSource& source, const ReaderOptions& options, Header header) {
  Index index{.header = std::move(header)};
  Result<StreamSummary> stream = read_stream(source, options, Scan(index));
  if (!stream) return tl::unexpected(stream.error());
  index.problems = std::move(stream->problems);
  index.statistics.schema_count = static_cast<std::uint16_t>(index.schemas.size());
  index.statistics.channel_count = static_cast<std::uint32_t>(index.channels.size());
  index.statistics.attachment_count = static_cast<std::uint32_t>(index.attachments.size());
  index.statistics.metadata_count = static_cast<std::uint32_t>(index.metadata.size());
  return index;
}

/// Content of the record at an offset, of the kind and length the index promises.
Result<Bytes> read_content(const ByteSource& source, std::uint64_t offset, std::uint64_t length,
                           Opcode opcode, const ReaderOptions& options) {
  if (length < kRecordPrefixSize || length > options.max_record_bytes) {
    return fail(ErrorCode::LimitExceeded, fmt::format("a record of {} bytes is not plausible", length),
                at(source, offset));
  }
  Bytes bytes(static_cast<std::size_t>(length));
  if (Status status = source.read(offset, bytes); !status) return tl::unexpected(status.error());
  const bool as_promised = bytes[0] == static_cast<std::uint8_t>(opcode) &&
                           from_little_endian<std::uint64_t>(bytes.data() + 1) == length - kRecordPrefixSize;
  if (!as_promised) {
    return fail(ErrorCode::Unreadable, "the index points to something else", at(source, offset),
                "Read it as a stream, which needs no index: delete the summary or cut the file before it.");
  }
  bytes.erase(bytes.begin(), bytes.begin() + kRecordPrefixSize);
  return bytes;
}

}  // namespace

Result<Index> read_index(const ByteSource& source, const ReaderOptions& options) {
  const Result<std::uint64_t> size = source.size();
  if (!size) return tl::unexpected(size.error());
  // The first record only; an error of our own ends the pass.
  Header header;
  const Result<StreamSummary> begin = read_stream(source, options, [&](const RecordView& view) -> Status {
    if (const Result<Header> first = decode<Header>(view.content); first && is<Header>(view.opcode))
      header = *first;
    return fail(ErrorCode::NotFound, "");
  });
  const bool stopped_by_us =
      !begin && begin.error().code == ErrorCode::NotFound && begin.error().message.empty();
  if (!begin && !stopped_by_us) return tl::unexpected(begin.error());

  Index index{.header = header, .from_summary = true};
  if (index_from_summary(source, *size, options, index)) return index;
  return index_from_scan(source, options, header);
}

namespace {

/// One chunk being merged: its unpacked records and the selected messages in order of time.
struct OpenChunk {
  Bytes records;
  std::vector<Message> messages;
  std::size_t next = 0;
  std::size_t number = 0;
};

Result<OpenChunk> open_chunk(const ByteSource& source, const ChunkIndex& entry,
                             const std::set<std::uint16_t>& channels, const Selection& selection,
                             const ReaderOptions& options) {
  const Result<Bytes> content =
      read_content(source, entry.chunk_start_offset, entry.chunk_length, Opcode::Chunk, options);
  if (!content) return tl::unexpected(content.error());
  const Result<Chunk> chunk = decode<Chunk>(*content);
  if (!chunk) return tl::unexpected(chunk.error());
  Result<Bytes> records = unpack_chunk(*chunk, options);
  if (!records) {
    Error error = records.error();
    error.place = at(source, entry.chunk_start_offset);
    return tl::unexpected(error);
  }
  OpenChunk open;
  open.records = std::move(*records);
  Status walked =
      visit_records(open.records, [&](std::uint8_t opcode, ByteSpan inner, std::size_t) -> Status {
        if (!is<Message>(opcode)) return {};
        const Result<Message> message = decode<Message>(inner);
        if (!message) return tl::unexpected(message.error());
        const bool wanted = channels.contains(message->channel_id) && message->log_time >= selection.from &&
                            message->log_time < selection.to;
        if (wanted) open.messages.push_back(*message);
        return {};
      });
  if (!walked) return tl::unexpected(walked.error());
  std::ranges::stable_sort(open.messages, {}, &Message::log_time);
  return open;
}

/// Chunks in order of their first message; the number in the file breaks ties.
std::vector<std::size_t> by_start_time(const std::vector<ChunkIndex>& chunks, const Selection& selection) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    if (chunks[i].message_end_time >= selection.from && chunks[i].message_start_time < selection.to)
      order.push_back(i);
  }
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return chunks[i].message_start_time; });
  return order;
}

}  // namespace

Status visit_messages(const ByteSource& source, const Index& index, const Selection& selection,
                      const std::function<Status(const Channel&, const Message&)>& visit,
                      const ReaderOptions& options) {
  std::set<std::uint16_t> channels;
  for (const auto& [id, channel] : index.channels) {
    if (selection.topics.empty() || selection.topics.contains(channel.topic)) channels.insert(id);
  }
  const auto later = [](const std::unique_ptr<OpenChunk>& a, const std::unique_ptr<OpenChunk>& b) {
    const std::uint64_t time_a = a->messages[a->next].log_time;
    const std::uint64_t time_b = b->messages[b->next].log_time;
    return time_a != time_b ? time_a > time_b : a->number > b->number;
  };
  std::vector<std::unique_ptr<OpenChunk>> heap;
  const std::vector<std::size_t> order = by_start_time(index.chunks, selection);
  std::size_t next_chunk = 0;
  while (!heap.empty() || next_chunk < order.size()) {
    // Open every chunk that may hold an earlier message than the earliest at hand.
    while (next_chunk < order.size() &&
           (heap.empty() || index.chunks[order[next_chunk]].message_start_time <=
                                heap.front()->messages[heap.front()->next].log_time)) {
      const std::size_t number = order[next_chunk++];
      Result<OpenChunk> chunk = open_chunk(source, index.chunks[number], channels, selection, options);
      if (!chunk) return tl::unexpected(chunk.error());
      if (chunk->messages.empty()) continue;
      chunk->number = number;
      heap.push_back(std::make_unique<OpenChunk>(std::move(*chunk)));
      std::ranges::push_heap(heap, later);
    }
    if (heap.empty()) continue;
    std::ranges::pop_heap(heap, later);
    OpenChunk& earliest = *heap.back();
    const Message& message = earliest.messages[earliest.next++];
    if (Status status = visit(index.channels.at(message.channel_id), message); !status) return status;
    if (earliest.next == earliest.messages.size()) {
      heap.pop_back();
    } else {
      std::ranges::push_heap(heap, later);
    }
  }
  return {};
}

Result<Attachment> read_attachment(const ByteSource& source, const AttachmentIndex& entry, Bytes& data,
                                   const ReaderOptions& options) {
  Result<Bytes> content = read_content(source, entry.offset, entry.length, Opcode::Attachment, options);
  if (!content) return tl::unexpected(content.error());
  data = std::move(*content);
  Result<Attachment> attachment = decode<Attachment>(data);
  if (!attachment) return attachment;
  const ByteSpan covered = ByteSpan(data).first(data.size() - sizeof(attachment->crc));
  if (attachment->crc != 0 && crc32(covered) != attachment->crc) {
    return fail(ErrorCode::Unreadable,
                fmt::format("the checksum of attachment '{}' is wrong", attachment->name),
                at(source, entry.offset));
  }
  return attachment;
}

Result<Metadata> read_metadata(const ByteSource& source, const MetadataIndex& entry,
                               const ReaderOptions& options) {
  const Result<Bytes> content = read_content(source, entry.offset, entry.length, Opcode::Metadata, options);
  if (!content) return tl::unexpected(content.error());
  return decode<Metadata>(*content);
}

}  // namespace waymark::mcap
