#include "waymark/recording/ros1_bag_index.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/recording/unpack.hpp"

namespace waymark::ros1bag {
namespace {

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

/// The bag header's own fields, 0 where it has none.
struct BagHeader {
  std::uint64_t index_offset = 0;
  std::uint32_t connections = 0;
  std::uint32_t chunks = 0;
  std::uint64_t end = 0;  ///< where the next record lies
};

Result<BagHeader> read_bag_header(const ByteSource& source) {
  const Result<RecordPlace> place = read_place(source, kMagic.size());
  if (!place) return tl::unexpected(place.error());
  const auto fields = Fields::parse(place->header);
  if (fields->number<std::uint8_t>("op") != static_cast<std::uint8_t>(Op::BagHeader))
    return fail(ErrorCode::Unreadable, "a ROS bag without its header", at(source, kMagic.size()));
  if (const std::string encryptor = fields->text("encryptor"); !encryptor.empty())
    return fail(ErrorCode::Unsupported, fmt::format("this bag is encrypted ({})", encryptor), at(source, 0),
                "Decrypt it with `rosbag decrypt`.");
  return BagHeader{.index_offset = fields->number<std::uint64_t>("index_pos").value_or(0),
                   .connections = fields->number<std::uint32_t>("conn_count").value_or(0),
                   .chunks = fields->number<std::uint32_t>("chunk_count").value_or(0),
                   .end = place->end()};
}

/// Files the chunk info record of the index. False when it makes no sense.
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

/// The index at the end of the file; nothing when it is not there or does not fit.
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

/// One pass over a bag whose index is missing.
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
      return Error{ErrorCode::Unreadable, "the bag ends here in the middle of a record", at(source_, offset),
                   "What precedes it is read."};
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
      if (!chunk) return;  // noted when it is visited
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

}  // namespace

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
    return fail(ErrorCode::LimitExceeded, fmt::format("a chunk of {} bytes is not plausible", end - begin),
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
      return fail(ErrorCode::Unreadable, "the index says that a chunk begins here", at(source, entry.offset));
    if (!packing)
      return fail(ErrorCode::Unsupported, fmt::format("chunks packed with '{}' cannot be read", name),
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
    chunk.damage = Error{ErrorCode::Unreadable, "the file ends in the middle of this chunk", {}, {}};
  if (chunk.damage) chunk.damage->place = at(source, entry.offset);
  return chunk;
}

Result<Index> read_index(const ByteSource& source, std::uint64_t max_chunk_bytes, LogProblems& problems) {
  const Result<std::uint64_t> size = source.size();
  if (!size) return tl::unexpected(size.error());
  const Result<BagHeader> header = read_bag_header(source);
  if (!header) return tl::unexpected(header.error());
  std::optional<Index> index = index_at_end(source, *header, *size);
  if (!index) {
    problems.damage("ros1bag.no_index", [&] {
      return Error{ErrorCode::Unreadable,
                   header->index_offset == 0
                       ? "the bag has no index: its recorder was stopped before it wrote one"
                       : "the index of the bag is cut or damaged",
                   at(source, header->index_offset), "It was read front to back."};
    });
    index = Scan(source, max_chunk_bytes, problems).run(header->end, *size);
  }
  if (!index->chunks.empty()) {
    if (const auto place = read_place(source, index->chunks.front().offset))
      index->compression = Fields::parse(place->header)->text("compression");
  }
  return std::move(*index);
}

}  // namespace waymark::ros1bag
