#include "waymark/recording/ros1/bag_log.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/recording/compression.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros_definition.hpp"
#include "waymark/recording/ros_log.hpp"

namespace waymark::ros1bag {
namespace {

constexpr std::uint64_t kBagSecond = 1'000'000'000;
constexpr std::uint32_t kMaxHeader = 1 << 20;

std::optional<Op> op_of(const Fields& fields) {
  const auto op = fields.number<std::uint8_t>("op");
  if (!op || *op < static_cast<std::uint8_t>(Op::Message) || *op > static_cast<std::uint8_t>(Op::Connection))
    return std::nullopt;
  return static_cast<Op>(*op);
}

tl::unexpected<Error> no_record(const ByteSource& source, std::uint64_t offset) {
  return fail(ErrorCode::Unreadable, "not a ROS bag record",
              {.source = source.name(), .byte = static_cast<std::int64_t>(offset)},
              "The file is truncated or damaged. Copy it again from its source.");
}

}  // namespace

std::optional<Fields> Fields::parse(ByteSpan header) {
  Fields out;
  ByteReader in(header);
  while (in.remaining() > 0) {
    const ByteSpan field = in.counted<std::uint32_t>();
    const std::string_view text = as_text(field);
    const std::size_t equals = text.find('=');
    if (in.failed() || equals == std::string_view::npos) return std::nullopt;
    out.fields_.emplace_back(text.substr(0, equals), field.subspan(equals + 1));
  }
  return out;
}

std::optional<ByteSpan> Fields::find(std::string_view name) const {
  const auto field = std::ranges::find(fields_, name, [](const auto& f) { return f.first; });
  return field == fields_.end() ? std::nullopt : std::optional(field->second);
}

std::string Fields::text(std::string_view name) const {
  return std::string(as_text(find(name).value_or(ByteSpan{})));
}

std::optional<std::uint64_t> Fields::time(std::string_view name) const {
  const auto bytes = find(name);
  return bytes && bytes->size() == 8 ? std::optional(time_ns(bytes->data())) : std::nullopt;
}

std::uint64_t time_ns(const std::uint8_t* bytes) {
  return from_little_endian<std::uint32_t>(bytes) * kBagSecond + from_little_endian<std::uint32_t>(bytes + 4);
}

std::optional<Record> next_record(ByteReader& bytes) {
  const ByteSpan header = bytes.counted<std::uint32_t>();
  const ByteSpan data = bytes.counted<std::uint32_t>();
  if (bytes.failed()) return std::nullopt;
  auto fields = Fields::parse(header);
  if (!fields) return std::nullopt;
  const std::optional<Op> op = op_of(*fields);
  if (!op) return std::nullopt;
  return Record{*op, std::move(*fields), data};
}

Result<RecordPlace> read_place(const ByteSource& source, std::uint64_t offset) {
  std::array<std::uint8_t, 4> length{};
  if (!source.read(offset, length)) return no_record(source, offset);
  const auto header_size = from_little_endian<std::uint32_t>(length.data());
  if (header_size > kMaxHeader) return no_record(source, offset);
  RecordPlace place{.header = Bytes(header_size), .offset = offset};
  place.data_offset = offset + 8 + header_size;
  if (!source.read(offset + 4, place.header) || !source.read(place.data_offset - 4, length))
    return no_record(source, offset);
  place.data_size = from_little_endian<std::uint32_t>(length.data());
  const auto fields = Fields::parse(place.header);
  if (!fields || !op_of(*fields)) return no_record(source, offset);
  return place;
}

std::optional<Connection> connection_of(const Fields& header, ByteSpan data) {
  const auto id = header.number<std::uint32_t>("conn");
  const auto fields = Fields::parse(data);
  if (!id || !fields) return std::nullopt;
  Connection connection{.id = *id,
                        .topic = header.text("topic"),
                        .type = fields->text("type"),
                        .md5sum = fields->text("md5sum"),
                        .definition = fields->text("message_definition"),
                        .caller = fields->text("callerid"),
                        .latching = fields->text("latching") == "1"};
  if (connection.topic.empty()) connection.topic = fields->text("topic");
  return connection;
}

namespace {

/// A chunk, or a message outside chunks (in an unchunked bag).
struct ChunkEntry {
  std::uint64_t offset = 0;
  std::uint64_t start_time = 0;  ///< time of the first message, in nanoseconds
  std::uint64_t end_time = 0;    ///< time of the last message, in nanoseconds
  bool bare_message = false;
};

struct Index {
  std::map<std::uint32_t, Connection> connections{};
  std::vector<ChunkEntry> chunks{};                 ///< in file order
  std::map<std::uint32_t, std::uint64_t> counts{};  ///< number of messages by connection
  bool from_file = false;                           ///< the bag has a consistent index
  std::string compression{};                        ///< compression of the first chunk: "none", "bz2", "lz4"
};

/// An unpacked chunk: all of it, or the part before damage.
struct OpenChunk {
  Bytes records{};
  std::optional<Error> damage{};
};

/// Unpacks the chunk at an offset; a bare message is returned unchanged.
[[nodiscard]] Result<OpenChunk> open_chunk(const ByteSource& source, const ChunkEntry& entry,
                                           std::uint64_t max_bytes);

/// Calls visit for each record in an unpacked chunk; returns false if the chunk ends at an invalid record.
bool visit_chunk(ByteSpan records, const std::function<void(const Record&)>& visit);

Place at(const ByteSource& source, std::uint64_t offset) {
  return {.source = source.name(), .byte = static_cast<std::int64_t>(offset)};
}

std::optional<Packing> packing_named(std::string_view name) {
  if (name == "none") return Packing::None;
  if (name == "bz2") return Packing::Bzip2;
  if (name == "lz4") return Packing::Lz4;
  return std::nullopt;
}

void widen(ChunkEntry& entry, bool first, std::uint64_t time) {
  entry.start_time = first ? time : std::min(entry.start_time, time);
  entry.end_time = first ? time : std::max(entry.end_time, time);
}

/// Fields of the bag header; 0 if missing.
struct BagHeader {
  std::uint64_t index_offset = 0;
  std::uint32_t connections = 0;
  std::uint32_t chunks = 0;
  std::uint64_t end = 0;  ///< offset of the next record
};

Result<BagHeader> read_bag_header(const ByteSource& source) {
  const Result<RecordPlace> place = read_place(source, kMagic.size());
  if (!place) return tl::unexpected(place.error());
  const auto fields = Fields::parse(place->header);
  if (fields->number<std::uint8_t>("op") != static_cast<std::uint8_t>(Op::BagHeader))
    return fail(ErrorCode::Unreadable, "the bag has no header record", at(source, kMagic.size()));
  if (const std::string encryptor = fields->text("encryptor"); !encryptor.empty())
    return fail(ErrorCode::Unsupported, fmt::format("the bag is encrypted ({})", encryptor), at(source, 0),
                "Decrypt it with `rosbag decrypt`.");
  return BagHeader{.index_offset = fields->number<std::uint64_t>("index_pos").value_or(0),
                   .connections = fields->number<std::uint32_t>("conn_count").value_or(0),
                   .chunks = fields->number<std::uint32_t>("chunk_count").value_or(0),
                   .end = place->end()};
}

/// Adds a chunk info record to the index. False if it is invalid.
bool file_chunk_info(Index& index, const Fields& fields, ByteSpan data) {
  const auto position = fields.number<std::uint64_t>("chunk_pos");
  const auto start = fields.time("start_time");
  const auto end = fields.time("end_time");
  if (!position || !start || !end) return false;
  index.chunks.push_back({.offset = *position, .start_time = *start, .end_time = *end});
  ByteReader counts(data);
  while (counts.remaining() >= 8) {
    const auto connection = counts.number<std::uint32_t>();
    index.counts[connection] += counts.number<std::uint32_t>();
  }
  return true;
}

/// The index at the end of the file; empty if it is missing or inconsistent.
std::optional<Index> index_at_end(const ByteSource& source, const BagHeader& header, std::uint64_t size) {
  if (header.index_offset < header.end || header.index_offset >= size) return std::nullopt;
  Index index{.from_file = true};
  Bytes data;
  for (std::uint64_t offset = header.index_offset; offset < size;) {
    const Result<RecordPlace> place = read_place(source, offset);
    if (!place || place->end() > size) return std::nullopt;
    data.resize(place->data_size);
    if (!source.read(place->data_offset, data)) return std::nullopt;
    const auto fields = Fields::parse(place->header);
    const auto op = static_cast<Op>(*fields->number<std::uint8_t>("op"));
    if (op == Op::Connection) {
      auto connection = connection_of(*fields, data);
      if (!connection) return std::nullopt;
      index.connections.insert_or_assign(connection->id, std::move(*connection));
    } else if (op == Op::ChunkInfo && !file_chunk_info(index, *fields, data)) {
      return std::nullopt;
    }
    offset = place->end();
  }
  const bool fits = index.connections.size() == header.connections && index.chunks.size() == header.chunks &&
                    std::ranges::all_of(index.chunks, [&](const ChunkEntry& c) { return c.offset < size; });
  if (!fits) return std::nullopt;
  std::ranges::sort(index.chunks, {}, &ChunkEntry::offset);
  return index;
}

/// One pass over a bag without an index.
class Scan {
 public:
  Scan(const ByteSource& source, std::uint64_t max_chunk_bytes, LogProblems& problems)
      : source_(source), max_chunk_bytes_(max_chunk_bytes), problems_(problems) {}

  Index run(std::uint64_t begin, std::uint64_t size) {
    for (std::uint64_t offset = begin; offset < size;) {
      const Result<RecordPlace> place = read_place(source_, offset);
      if (!place) {
        cut(offset);
        break;
      }
      on_record(*place);
      if (place->end() > size) {
        cut(offset);
        break;
      }
      offset = place->end();
    }
    return std::move(index_);
  }

 private:
  void cut(std::uint64_t offset) {
    problems_.damage("ros1bag.cut", [&] {
      return Error{ErrorCode::Unreadable, "truncated record at the end of the bag", at(source_, offset),
                   "Records before it are read."};
    });
  }

  void on_record(const RecordPlace& place) {
    const auto fields = Fields::parse(place.header);
    const auto op = static_cast<Op>(*fields->number<std::uint8_t>("op"));
    if (op == Op::Connection && place.data_size <= max_chunk_bytes_) {
      Bytes data(place.data_size);
      if (!source_.read(place.data_offset, data)) return;
      file_connection(*fields, data);
    } else if (op == Op::Chunk || op == Op::Message) {
      ChunkEntry entry{.offset = place.offset, .bare_message = op == Op::Message};
      const Result<OpenChunk> chunk = open_chunk(source_, entry, max_chunk_bytes_);
      if (!chunk) return;  // already noted during the visit
      bool first = true;
      (void)visit_chunk(chunk->records, [&](const Record& record) {
        if (record.op == Op::Connection) file_connection(record.fields, record.data);
        if (record.op != Op::Message) return;
        widen(entry, first, record.fields.time("time").value_or(0));
        first = false;
        ++index_.counts[record.fields.number<std::uint32_t>("conn").value_or(0)];
      });
      if (!first || chunk->damage) index_.chunks.push_back(entry);
    }
  }

  void file_connection(const Fields& fields, ByteSpan data) {
    if (auto connection = connection_of(fields, data))
      index_.connections.try_emplace(connection->id, std::move(*connection));
  }

  const ByteSource& source_;
  std::uint64_t max_chunk_bytes_;
  LogProblems& problems_;
  Index index_;
};

bool visit_chunk(ByteSpan records, const std::function<void(const Record&)>& visit) {
  ByteReader reader(records);
  while (reader.remaining() > 0) {
    const std::optional<Record> record = next_record(reader);
    if (!record) return false;
    visit(*record);
  }
  return true;
}

Result<OpenChunk> open_chunk(const ByteSource& source, const ChunkEntry& entry, std::uint64_t max_bytes) {
  const Result<RecordPlace> place = read_place(source, entry.offset);
  if (!place) return tl::unexpected(place.error());
  const Result<std::uint64_t> size = source.size();
  if (!size) return tl::unexpected(size.error());
  const std::uint64_t begin = entry.bare_message ? place->offset : place->data_offset;
  const std::uint64_t end = std::min(place->end(), *size);
  if (end - begin > max_bytes)
    return fail(ErrorCode::LimitExceeded, fmt::format("implausible chunk size of {} bytes", end - begin),
                at(source, entry.offset));
  Bytes packed(static_cast<std::size_t>(end - begin));
  if (Status status = source.read(begin, packed); !status) return tl::unexpected(status.error());
  OpenChunk chunk;
  if (entry.bare_message) {
    chunk.records = std::move(packed);
  } else {
    const auto fields = Fields::parse(place->header);
    const std::string name = fields->text("compression");
    const std::optional<Packing> packing = packing_named(name);
    if (fields->number<std::uint8_t>("op") != static_cast<std::uint8_t>(Op::Chunk))
      return fail(ErrorCode::Unreadable, "no chunk at the offset given by the index",
                  at(source, entry.offset));
    if (!packing)
      return fail(ErrorCode::Unsupported, fmt::format("unsupported chunk compression '{}'", name),
                  at(source, entry.offset), "Known: none, bz2, lz4.");
    const std::uint32_t unpacked_size = fields->number<std::uint32_t>("size").value_or(0);
    UnpackedBytes unpacked =
        unpack_bytes(*packing, packed, std::min<std::uint64_t>(unpacked_size, max_bytes));
    chunk.records = std::move(unpacked.bytes);
    chunk.damage = std::move(unpacked.damage);
    if (!chunk.damage && chunk.records.size() != unpacked_size)
      chunk.damage = Error{ErrorCode::Unreadable,
                           fmt::format("{} bytes instead of {}", chunk.records.size(), unpacked_size),
                           {},
                           {}};
  }
  if (place->end() > *size && !chunk.damage)
    chunk.damage = Error{ErrorCode::Unreadable, "the file ends inside this chunk", {}, {}};
  if (chunk.damage) chunk.damage->place = at(source, entry.offset);
  return chunk;
}

/// Reads the bag's own index or, if it is missing or inconsistent, makes one pass over the file. Damage ends
/// the pass and is noted. Fails if the file is not a bag.
Result<Index> read_index(const ByteSource& source, std::uint64_t max_chunk_bytes, LogProblems& problems) {
  const Result<std::uint64_t> size = source.size();
  if (!size) return tl::unexpected(size.error());
  const Result<BagHeader> header = read_bag_header(source);
  if (!header) return tl::unexpected(header.error());
  std::optional<Index> index = index_at_end(source, *header, *size);
  if (!index) {
    problems.damage("ros1bag.no_index", [&] {
      return Error{ErrorCode::Unreadable,
                   header->index_offset == 0 ? "the bag has no index: its recorder did not finish"
                                             : "the index of the bag is truncated or damaged",
                   at(source, header->index_offset), "The bag was read sequentially."};
    });
    index = Scan(source, max_chunk_bytes, problems).run(header->end, *size);
  }
  if (!index->chunks.empty()) {
    if (const auto place = read_place(source, index->chunks.front().offset))
      index->compression = Fields::parse(place->header)->text("compression");
  }
  return std::move(*index);
}

}  // namespace
}  // namespace waymark::ros1bag

namespace waymark {
namespace {

using ros1bag::ChunkEntry;
using ros1bag::Op;
using ros1bag::Record;

/// A chunk being merged: its unpacked records and its messages in time order.
struct Merged {
  struct Message {
    std::uint64_t time = 0;
    std::size_t channel = 0;
    ByteSpan data{};
  };
  Bytes records{};
  std::vector<Message> messages{};
  std::size_t next = 0;
  std::size_t number = 0;
  [[nodiscard]] std::uint64_t time() const { return messages[next].time; }
};

class Ros1BagLog final : public RosLog {
 public:
  Ros1BagLog(std::unique_ptr<ByteSource> source, ros1bag::Index index, LogProblems problems,
             const LogOptions& options)
      : source_(std::move(source)),
        index_(std::move(index)),
        options_(options),
        opened_(std::move(problems)) {
    for (const auto& [id, connection] : index_.connections) add_channel(id, connection);
  }

  LogFormat format() const override { return LogFormat::Ros1Bag; }
  std::string description() const override {
    return fmt::format("ROS 1 bag 2.0, {} chunks{}{}", index_.chunks.size(),
                       index_.compression.empty() || index_.compression == "none"
                           ? ""
                           : ", packed with " + index_.compression,
                       index_.from_file ? "" : ", without a usable index");
  }
  const std::vector<LogChannel>& channels() const override { return channels_; }

  LogSummary summary() const override {
    LogSummary summary{.messages = 0, .size_bytes = source_->size().value_or(0), .files = {source_->name()}};
    for (const auto& [connection, count] : index_.counts) *summary.messages += count;
    for (const ChunkEntry& chunk : index_.chunks) {
      summary.start = std::min(summary.start.value_or(chunk.start_time), chunk.start_time);
      summary.end = std::max(summary.end.value_or(chunk.end_time), chunk.end_time);
    }
    return summary;
  }

  Status visit(const LogSelection& selection, const Visitor& visit) override {
    visited_.clear();
    const std::vector<std::size_t> order = by_start_time(selection);
    std::vector<std::unique_ptr<Merged>> heap;
    const auto later = [](const auto& a, const auto& b) {
      return a->time() != b->time() ? a->time() > b->time() : a->number > b->number;
    };
    for (std::size_t next = 0; !heap.empty() || next < order.size();) {
      // Opens every chunk that may contain an earlier message than the earliest open one.
      while (next < order.size() &&
             (heap.empty() || index_.chunks[order[next]].start_time <= heap.front()->time())) {
        const std::size_t number = order[next++];
        std::unique_ptr<Merged> chunk = open(index_.chunks[number], selection);
        if (!chunk || chunk->messages.empty()) continue;
        chunk->number = number;
        heap.push_back(std::move(chunk));
        std::ranges::push_heap(heap, later);
      }
      if (heap.empty()) continue;
      std::ranges::pop_heap(heap, later);
      Merged& earliest = *heap.back();
      const Merged::Message message = earliest.messages[earliest.next++];
      const Status status = visit(channels_[message.channel], {message.time, message.time, message.data});
      if (!status) return status;
      if (earliest.next == earliest.messages.size()) {
        heap.pop_back();
      } else {
        std::ranges::push_heap(heap, later);
      }
    }
    return {};
  }

  std::vector<LogProblem> problems() const override { return joined(opened_, visited_); }

 private:
  /// Connections of several publishers on one topic become one channel.
  void add_channel(std::uint32_t id, const ros1bag::Connection& connection) {
    LogChannel channel{.topic = connection.topic,
                       .type = ros::ros2_type(connection.type),
                       .encoding = "ros1",
                       .schema_encoding = "ros1msg",
                       .schema = connection.definition,
                       .metadata = {{"md5sum", connection.md5sum}, {"ros1_type", connection.type}},
                       .messages = 0};
    if (connection.latching) channel.metadata["latching"] = "1";
    const auto same = std::ranges::find_if(channels_, [&](const LogChannel& known) {
      return known.topic == channel.topic && known.type == channel.type && known.schema == channel.schema;
    });
    channel_of_[id] = static_cast<std::size_t>(same - channels_.begin());
    LogChannel& kept = same == channels_.end() ? channels_.emplace_back(std::move(channel)) : *same;
    if (!connection.caller.empty()) {
      std::string& callers = kept.metadata["callerid"];
      callers += (callers.empty() ? "" : " ") + connection.caller;
    }
    if (const auto count = index_.counts.find(id); count != index_.counts.end())
      *kept.messages += count->second;
  }

  [[nodiscard]] std::vector<std::size_t> by_start_time(const LogSelection& selection) const {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < index_.chunks.size(); ++i) {
      if (index_.chunks[i].end_time >= selection.from && index_.chunks[i].start_time < selection.to)
        order.push_back(i);
    }
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return index_.chunks[i].start_time; });
    return order;
  }

  std::unique_ptr<Merged> open(const ChunkEntry& entry, const LogSelection& selection) {
    Result<ros1bag::OpenChunk> chunk = open_chunk(*source_, entry, options_.max_record_bytes);
    if (!chunk) {
      visited_.damage("ros1bag.chunk", [&] { return chunk.error(); });
      return nullptr;
    }
    auto merged = std::make_unique<Merged>();
    merged->records = std::move(chunk->records);
    const bool whole = ros1bag::visit_chunk(merged->records, [&](const Record& record) {
      if (record.op != Op::Message) return;
      const auto time = record.fields.time("time");
      const auto channel = channel_of_.find(record.fields.number<std::uint32_t>("conn").value_or(~0U));
      if (!time || channel == channel_of_.end()) {
        visited_.damage("ros1bag.message", [&] {
          return Error{ErrorCode::Unreadable, "message without time or connection", place(entry), {}};
        });
        return;
      }
      if (selection.takes(*time) && selection.takes(channels_[channel->second].topic))
        merged->messages.push_back({*time, channel->second, record.data});
    });
    if (chunk->damage || !whole) {
      visited_.damage("ros1bag.chunk", [&] {
        Error error = chunk->damage.value_or(
            Error{ErrorCode::Unreadable, "invalid record in a chunk", place(entry), {}});
        error.hint = "The messages before the damage are read.";
        return error;
      });
    }
    std::ranges::stable_sort(merged->messages, {}, &Merged::Message::time);
    return merged;
  }

  [[nodiscard]] Place place(const ChunkEntry& entry) const {
    return {.source = source_->name(), .byte = static_cast<std::int64_t>(entry.offset)};
  }

  std::unique_ptr<ByteSource> source_;
  ros1bag::Index index_;
  LogOptions options_;
  std::vector<LogChannel> channels_;
  std::map<std::uint32_t, std::size_t> channel_of_;
  LogProblems opened_;
};

}  // namespace

Result<std::unique_ptr<MessageLog>> open_ros1_bag(std::unique_ptr<ByteSource> source,
                                                  const LogOptions& options) {
  LogProblems problems;
  Result<ros1bag::Index> index = ros1bag::read_index(*source, options.max_record_bytes, problems);
  if (!index) return tl::unexpected(index.error());
  return std::make_unique<Ros1BagLog>(std::move(source), std::move(*index), std::move(problems), options);
}

}  // namespace waymark
