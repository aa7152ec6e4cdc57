#include "waymark/recording/mcap/reader.hpp"

#include <algorithm>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "waymark/recording/compression.hpp"
#include "waymark/recording/mcap/index.hpp"

namespace waymark::mcap {
Result<Attachment> read_attachment(const ByteSource& source, const AttachmentIndex& entry, Bytes& data,
                                   const ReaderOptions& options) {
  const Result<ByteSpan> content =
      read_content(source, entry.offset, entry.length, Opcode::Attachment, options, data);
  if (!content) return tl::unexpected(content.error());
  return decode_attachment(*content, at(source, entry.offset));
}

Result<Attachment> decode_attachment(ByteSpan content, const Place& place) {
  Result<Attachment> attachment = decode<Attachment>(content);
  if (!attachment) return attachment;
  // Covers all fields before the checksum, but not fields that a later version may append.
  const ByteSpan& last = attachment->data.bytes;
  const ByteSpan covered =
      content.first(static_cast<std::size_t>(last.data() + last.size() - content.data()));
  if (attachment->crc != 0 && crc32(covered) != attachment->crc) {
    return fail(ErrorCode::Unreadable, fmt::format("wrong checksum of attachment '{}'", attachment->name),
                place);
  }
  return attachment;
}

Result<Metadata> read_metadata(const ByteSource& source, const MetadataIndex& entry,
                               const ReaderOptions& options) {
  Bytes room;
  const Result<ByteSpan> content =
      read_content(source, entry.offset, entry.length, Opcode::Metadata, options, room);
  if (!content) return tl::unexpected(content.error());
  return decode<Metadata>(*content);
}

namespace {

/// The selected part of a file.
struct Wanted {
  std::vector<const Channel*> channels{};  ///< by id; nullptr for channels that are not selected
  std::uint64_t from = 0;
  std::uint64_t to = 0;

  [[nodiscard]] bool channel(std::uint16_t id) const {
    return id < channels.size() && channels[id] != nullptr;
  }
  [[nodiscard]] bool operator()(const Message& message) const {
    return channel(message.channel_id) && message.log_time >= from && message.log_time < to;
  }
};

/// Messages in time order, from one chunk or from all messages outside chunks.
struct Run {
  Bytes content;  ///< the chunk as stored in the file
  Bytes room;     ///< the chunk's records, if compressed
  std::vector<Message> messages;
  std::size_t next = 0;
  std::size_t number = 0;  ///< breaks ties

  [[nodiscard]] const Message& front() const { return messages[next]; }
  [[nodiscard]] std::uint64_t bytes() const { return content.size() + room.size(); }
};

/// Collects the selected messages of a chunk in file order. Bypasses decode() for speed.
Status collect(ByteSpan records, const Wanted& wanted, std::vector<Message>& messages) {
  constexpr std::size_t kFields = 22;
  ByteReader in(records);
  while (in.remaining() > 0) {
    const auto opcode = in.number<std::uint8_t>();
    const ByteSpan content = in.counted<std::uint64_t>();
    const bool message = is<Message>(opcode);
    if (in.failed() || (message && content.size() < kFields))
      return fail(ErrorCode::Unreadable, "truncated record in a chunk");
    if (!message) continue;
    const Message found{.channel_id = from_little_endian<std::uint16_t>(content.data()),
                        .sequence = from_little_endian<std::uint32_t>(content.data() + 2),
                        .log_time = from_little_endian<std::uint64_t>(content.data() + 6),
                        .publish_time = from_little_endian<std::uint64_t>(content.data() + 14),
                        .data = {content.subspan(kFields)}};
    if (wanted(found)) messages.push_back(found);
  }
  return {};
}

Status load_chunk(const ByteSource& source, const ChunkIndex& entry, const Wanted& wanted,
                  const ReaderOptions& options, Run& run) {
  const Result<ByteSpan> content =
      read_content(source, entry.chunk_start_offset, entry.chunk_length, Opcode::Chunk, options, run.content);
  if (!content) return tl::unexpected(content.error());
  const Result<Chunk> chunk = decode<Chunk>(*content);
  if (!chunk) return tl::unexpected(chunk.error());
  const Result<ByteSpan> records = unpack_chunk(*chunk, options, run.room);
  if (!records) return tl::unexpected(records.error());
  return collect(*records, wanted, run.messages);
}

Status load_loose(const ByteSource& source, const LooseMessage& entry, const Wanted& wanted,
                  const ReaderOptions& options, Run& run) {
  const Result<ByteSpan> content =
      read_content(source, entry.offset, entry.length, Opcode::Message, options, run.content);
  if (!content) return tl::unexpected(content.error());
  const Result<Message> message = decode<Message>(*content);
  if (!message) return tl::unexpected(message.error());
  if (wanted(*message)) run.messages.push_back(*message);
  return {};
}

/// Reports damage and skips it, or ends the visit.
Status skip_damage(const ByteSource& source, Error error, std::uint64_t offset,
                   const ReaderOptions& options) {
  if (!error.place.byte || error.place.source.empty()) error.place = at(source, offset);
  if (!options.on_damage) return tl::unexpected(error);
  options.on_damage(error);
  return {};
}

Wanted wanted_of(const Index& index, const Selection& selection) {
  Wanted wanted{.from = selection.from, .to = selection.to};
  for (const auto& [id, channel] : index.channels) {
    if (!selection.topics.empty() && !selection.topics.contains(channel.topic)) continue;
    if (wanted.channels.size() <= id) wanted.channels.resize(std::size_t{id} + 1);
    wanted.channels[id] = &channel;
  }
  return wanted;
}

/// Chunks that may contain selected messages, in order of their first message; ties are broken by file
/// offset.
std::vector<std::size_t> chunks_in_order(const std::vector<ChunkIndex>& chunks, const Wanted& wanted) {
  const auto may_hold = [&](const ChunkIndex& chunk) {
    if (chunk.message_end_time < wanted.from || chunk.message_start_time >= wanted.to) return false;
    // Without message indexes, the channels in a chunk are unknown.
    return chunk.message_index_offsets.empty() ||
           std::ranges::any_of(chunk.message_index_offsets,
                               [&](const auto& offset) { return wanted.channel(offset.first); });
  };
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < chunks.size(); ++i)
    if (may_hold(chunks[i])) order.push_back(i);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return chunks[i].message_start_time; });
  return order;
}

/// Merges chunks that overlap in time, and messages outside chunks.
class Merge {
 public:
  Merge(const ByteSource& source, const Index& index, Wanted wanted, const ReaderOptions& options)
      : source_(source),
        index_(index),
        wanted_(std::move(wanted)),
        options_(options),
        order_(chunks_in_order(index.chunks, wanted_)),
        loose_(index.loose) {
    std::erase_if(loose_, [this](const LooseMessage& message) {
      return message.log_time < wanted_.from || message.log_time >= wanted_.to;
    });
    std::ranges::stable_sort(loose_, {}, &LooseMessage::log_time);
  }

  Status run(const std::function<Status(const Channel&, const Message&)>& visit) {
    while (true) {
      if (Status status = open_possible_next_chunks(); !status) return status;
      if (heap_.empty()) return {};
      std::ranges::pop_heap(heap_, later);
      Run& earliest = *heap_.back();
      const Message& message = earliest.messages[earliest.next++];
      if (Status status = visit(*wanted_.channels[message.channel_id], message); !status) return status;
      if (earliest.next < earliest.messages.size()) {
        std::ranges::push_heap(heap_, later);
      } else {
        held_bytes_ -= earliest.bytes();
        spare_.push_back(std::move(heap_.back()));
        heap_.pop_back();
      }
    }
  }

 private:
  static bool later(const std::unique_ptr<Run>& a, const std::unique_ptr<Run>& b) {
    const std::uint64_t time_a = a->front().log_time;
    const std::uint64_t time_b = b->front().log_time;
    return time_a != time_b ? time_a > time_b : a->number > b->number;
  }
  [[nodiscard]] bool may_be_next(std::uint64_t start) const {
    return heap_.empty() || start <= heap_.front()->front().log_time;
  }

  /// Opens every chunk that may contain an earlier message than the earliest open one.
  Status open_possible_next_chunks() {
    while (next_chunk_ < order_.size() &&
           may_be_next(index_.chunks[order_[next_chunk_]].message_start_time)) {
      const std::size_t number = order_[next_chunk_++];
      const ChunkIndex& entry = index_.chunks[number];
      std::unique_ptr<Run> run = fresh(number);
      Status status = load_chunk(source_, entry, wanted_, options_, *run);
      if (!std::ranges::is_sorted(run->messages, {}, &Message::log_time))
        std::ranges::stable_sort(run->messages, {}, &Message::log_time);
      if (!status) status = skip_damage(source_, status.error(), entry.chunk_start_offset, options_);
      if (!status) return status;
      if (status = push(std::move(run)); !status) return status;
    }
    while (next_loose_ < loose_.size() && may_be_next(loose_[next_loose_].log_time)) {
      const LooseMessage& entry = loose_[next_loose_];
      std::unique_ptr<Run> run = fresh(index_.chunks.size() + next_loose_++);
      Status status = load_loose(source_, entry, wanted_, options_, *run);
      if (!status) status = skip_damage(source_, status.error(), entry.offset, options_);
      if (!status) return status;
      if (status = push(std::move(run)); !status) return status;
    }
    return {};
  }

  /// An empty run that reuses the memory of a finished run.
  std::unique_ptr<Run> fresh(std::size_t number) {
    std::unique_ptr<Run> run;
    if (spare_.empty()) {
      run = std::make_unique<Run>();
    } else {
      run = std::move(spare_.back());
      spare_.pop_back();
    }
    run->messages.clear();
    run->next = 0;
    run->number = number;
    return run;
  }

  Status push(std::unique_ptr<Run> run) {
    if (run->messages.empty()) {
      spare_.push_back(std::move(run));
      return {};
    }
    held_bytes_ += run->bytes();
    heap_.push_back(std::move(run));
    std::ranges::push_heap(heap_, later);
    if (heap_.size() == 1 || held_bytes_ <= options_.max_record_bytes) return {};
    return fail(ErrorCode::LimitExceeded,
                fmt::format("{} chunks that overlap in time exceed the limit of {} bytes", heap_.size(),
                            options_.max_record_bytes),
                {.source = source_.name()}, "Read the file as a stream.");
  }

  const ByteSource& source_;
  const Index& index_;
  Wanted wanted_;
  const ReaderOptions& options_;
  std::vector<std::size_t> order_;
  std::vector<LooseMessage> loose_;
  std::size_t next_chunk_ = 0;
  std::size_t next_loose_ = 0;
  std::uint64_t held_bytes_ = 0;
  std::vector<std::unique_ptr<Run>> heap_;
  std::vector<std::unique_ptr<Run>> spare_;
};

}  // namespace

Status visit_messages(const ByteSource& source, const Index& index, const Selection& selection,
                      const std::function<Status(const Channel&, const Message&)>& visit,
                      const ReaderOptions& options) {
  return Merge(source, index, wanted_of(index, selection), options).run(visit);
}

Status visit_as_written(const ByteSource& source, const Index& index,
                        const std::function<Status(const Channel&, const Message&)>& visit,
                        const ReaderOptions& options) {
  const Wanted wanted = wanted_of(index, {});
  Run run;
  std::size_t loose = 0;
  const auto give = [&](Status status, std::uint64_t offset) {
    if (!status) status = skip_damage(source, status.error(), offset, options);
    for (std::size_t i = 0; status && i < run.messages.size(); ++i)
      status = visit(*wanted.channels[run.messages[i].channel_id], run.messages[i]);
    run.messages.clear();
    return status;
  };
  const auto give_loose_before = [&](std::uint64_t end) {
    Status status;
    for (; status && loose < index.loose.size() && index.loose[loose].offset < end; ++loose)
      status = give(load_loose(source, index.loose[loose], wanted, options, run), index.loose[loose].offset);
    return status;
  };
  for (const ChunkIndex& entry : index.chunks) {
    Status status = give_loose_before(entry.chunk_start_offset);
    if (status) status = give(load_chunk(source, entry, wanted, options, run), entry.chunk_start_offset);
    if (!status) return status;
  }
  return give_loose_before(std::numeric_limits<std::uint64_t>::max());
}

}  // namespace waymark::mcap
