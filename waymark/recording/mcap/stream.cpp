#include "waymark/recording/mcap/stream.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <fmt/format.h>

#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/byte_io.hpp"
#include "waymark/recording/compression.hpp"
#include "waymark/recording/mcap/records.hpp"

namespace waymark::mcap {
namespace {

// Record prefix, start and end time, unpacked size, CRC; then the compression name preceded by its length (at
// most "zstd"), and the length of the records.
constexpr std::size_t kToCompression = 1 + 8 + 8 + 8 + 8 + 4;

constexpr std::size_t kHeader = kToCompression + 4 + 4 + 8;

bool is_chunk(ByteSpan header, std::uint64_t left) {
  if (header[0] != static_cast<std::uint8_t>(Opcode::Chunk)) return false;
  const auto length = from_little_endian<std::uint64_t>(&header[1]);
  const auto named = from_little_endian<std::uint32_t>(&header[kToCompression]);
  if (length > left || (named != 0 && named != 3 && named != 4)) return false;  // "", "lz4", "zstd"
  const auto records = from_little_endian<std::uint64_t>(&header[kToCompression + 4 + named]);
  const std::uint64_t around = kToCompression - 9 + 4 + named + 8;
  return records <= length && length == around + records && kRecordPrefixSize + length <= left;
}

/// The offset of the next chunk at or after `offset`, recognised by its opcode and by a length consistent
/// with the lengths inside it and with the file size. Empty if there is none or the source cannot be read.
/// O(bytes).
std::optional<std::uint64_t> find_chunk(const ByteSource& source, std::uint64_t offset, std::uint64_t size) {
  constexpr std::uint64_t kBlock = 1 << 20;
  Bytes block;
  while (offset + kHeader <= size) {
    block.resize(std::min(kBlock + kHeader, size - offset));
    if (!source.read(offset, block)) return std::nullopt;
    const std::size_t ends = block.size() - kHeader + 1;
    for (std::size_t i = 0; i < ends; ++i)
      if (is_chunk(ByteSpan(block).subspan(i, kHeader), size - offset - i)) return offset + i;
    offset += ends;
  }
  return std::nullopt;
}

Status check_magic(const ByteSource& source, std::uint64_t size) {
  std::uint8_t magic[sizeof(kMagic)] = {};
  const bool enough = size >= sizeof(kMagic);
  if (enough) {
    if (Status status = source.read(0, magic); !status) return status;
  }
  if (!enough || !std::ranges::equal(magic, kMagic)) {
    return fail(ErrorCode::Unreadable, "not an MCAP file: does not begin with the MCAP magic", at(source, 0));
  }
  return {};
}

/// A complete record between `offset` and `size`.
struct Frame {
  std::uint8_t opcode = 0;
  std::uint64_t length = 0;
};

Result<Frame> read_frame(const ByteSource& source, std::uint64_t offset, std::uint64_t size,
                         const ReaderOptions& options) {
  if (size == offset)
    return fail(ErrorCode::Unreadable, "the file ends here without a summary", at(source, offset));
  if (size - offset < kRecordPrefixSize)
    return fail(ErrorCode::Unreadable, "the file is truncated inside a record", at(source, offset));
  std::uint8_t prefix[kRecordPrefixSize] = {};
  if (Status status = source.read(offset, prefix); !status) return tl::unexpected(status.error());
  const Frame frame{.opcode = prefix[0], .length = from_little_endian<std::uint64_t>(prefix + 1)};
  if (frame.length > size - offset - kRecordPrefixSize) {
    return fail(ErrorCode::Unreadable,
                fmt::format("a record of {} bytes extends past the end of the file", frame.length),
                at(source, offset));
  }
  if (frame.length > options.max_record_bytes) {
    return fail(
        ErrorCode::LimitExceeded,
        fmt::format("a record of {} bytes exceeds the limit of {}", frame.length, options.max_record_bytes),
        at(source, offset));
  }
  return frame;
}

/// Reads the record at `offset`. Its length must not extend past `next`, the offset of the next known record,
/// if any.
Result<RecordView> read_record(const ByteSource& source, std::uint64_t offset, std::uint64_t size,
                               std::optional<std::uint64_t> next, const ReaderOptions& options,
                               Bytes& content) {
  const Result<Frame> frame = read_frame(source, offset, size, options);
  if (!frame) return tl::unexpected(frame.error());
  if (next && offset + kRecordPrefixSize + frame->length > *next)
    return fail(ErrorCode::Unreadable,
                fmt::format("a record of {} bytes extends past the next record at byte {}: its length is "
                            "damaged",
                            frame->length, *next),
                at(source, offset));
  content.resize(static_cast<std::size_t>(frame->length));
  if (Status status = source.read(offset + kRecordPrefixSize, content); !status)
    return tl::unexpected(status.error());
  return RecordView{.opcode = frame->opcode, .content = content, .offset = offset};
}

/// Visits the records in a chunk, after the record of the chunk itself.
Status visit_chunk(const RecordView& view, const ReaderOptions& options, Bytes& room, const Place& place,
                   StreamSummary& summary, const std::function<Status(const RecordView&)>& visit) {
  const auto damaged = [&](Error problem) {
    problem.place = place;
    summary.problems.push_back(std::move(problem));
  };
  const Result<Chunk> chunk = decode<Chunk>(view.content);
  const Result<ByteSpan> records =
      chunk ? unpack_chunk(*chunk, options, room) : Result<ByteSpan>(tl::unexpected(chunk.error()));
  if (!records) {
    damaged(records.error());
    return {};
  }
  Status callback = visit(view);
  if (!callback) return callback;
  const Status walked =
      visit_records(*records, [&](std::uint8_t opcode, ByteSpan inner, std::size_t inner_offset) {
        callback = visit({opcode, inner, view.offset, true, inner_offset});
        return callback;
      });
  if (!callback) return callback;
  if (!walked) damaged(walked.error());
  return {};
}

std::optional<std::uint64_t> first_of(const std::vector<KnownRecord>& known, std::uint64_t size) {
  if (known.empty() || known.front().offset >= size) return std::nullopt;
  return known.front().offset;
}

bool ends_with_magic(const ByteSource& source, std::uint64_t offset, std::uint64_t size) {
  std::uint8_t magic[sizeof(kMagic)] = {};
  return size - offset == sizeof(kMagic) && source.read(offset, magic) && std::ranges::equal(magic, kMagic);
}

}  // namespace

Result<ByteSpan> unpack_chunk(const Chunk& chunk, const ReaderOptions& options, Bytes& room) {
  const Result<Compression> compression = parse_compression(chunk.compression);
  if (!compression) return tl::unexpected(compression.error());
  if (chunk.uncompressed_size > options.max_record_bytes) {
    return fail(ErrorCode::LimitExceeded, fmt::format("a chunk of {} bytes exceeds the limit of {}",
                                                      chunk.uncompressed_size, options.max_record_bytes));
  }
  Result<ByteSpan> records = decompress(*compression, chunk.records.bytes, chunk.uncompressed_size, room);
  if (records && chunk.uncompressed_crc != 0 && crc32(*records) != chunk.uncompressed_crc) {
    return fail(ErrorCode::Unreadable, "wrong chunk checksum (CRC-32): bytes were changed or lost");
  }
  return records;
}

Status visit_records(ByteSpan bytes,
                     const std::function<Status(std::uint8_t, ByteSpan, std::size_t)>& visit) {
  ByteReader in(bytes);
  while (in.remaining() > 0) {
    const std::size_t offset = in.position();
    const auto opcode = in.number<std::uint8_t>();
    const ByteSpan content = in.counted<std::uint64_t>();
    if (in.failed())
      return fail(ErrorCode::Unreadable, "truncated record", {.byte = static_cast<std::int64_t>(offset)});
    if (Status status = visit(opcode, content, offset); !status) return status;
  }
  return {};
}

Result<StreamSummary> read_stream(const ByteSource& source, const ReaderOptions& options,
                                  const std::function<Status(const RecordView&)>& visit,
                                  const std::vector<KnownRecord>& known, bool search) {
  const Result<std::uint64_t> size = source.size();
  if (!size) return tl::unexpected(size.error());
  StreamSummary summary{.good_bytes = sizeof(kMagic)};
  if (const Status magic = check_magic(source, *size); !magic) {  // the beginning of the file is lost
    const auto first = known.empty() && search ? find_chunk(source, 0, *size) : first_of(known, *size);
    if (!first) {
      Error none = magic.error();
      none.hint = "Check that this is the right file.";
      return tl::unexpected(none);
    }
    summary.problems.push_back(magic.error());
    summary.skipped_bytes = *first;
    summary.good_bytes = *first;
  }
  Bytes content;
  Bytes room;
  bool footer = false;
  while (!footer) {
    const std::uint64_t offset = summary.good_bytes;
    const auto here = std::ranges::lower_bound(known, offset, {}, &KnownRecord::offset);
    const bool is_known = here != known.end() && here->offset == offset;
    const auto after = is_known ? here + 1 : here;
    auto next = after == known.end() || after->offset > *size ? std::nullopt : std::optional(after->offset);
    Result<RecordView> view = read_record(source, offset, *size, next, options, content);
    if (view && is_known && view->opcode != here->opcode)
      view = fail(
          ErrorCode::Unreadable,
          fmt::format("damaged record: its type is {}, but {} in the summary", view->opcode, here->opcode),
          at(source, offset));
    if (!view) {
      summary.problems.push_back(view.error());
      if (!next && search) next = find_chunk(source, offset + 1, *size);
      if (!next) return summary;
      summary.skipped_bytes += *next - offset;
      summary.good_bytes = *next;
      continue;
    }
    const std::size_t problems = summary.problems.size();
    const bool chunk = view->opcode == static_cast<std::uint8_t>(Opcode::Chunk);
    Status status =
        chunk ? visit_chunk(*view, options, room, at(source, offset), summary, visit) : visit(*view);
    if (!status) return tl::unexpected(status.error());
    if (summary.problems.size() > problems) summary.skipped_bytes += kRecordPrefixSize + view->content.size();
    footer = view->opcode == static_cast<std::uint8_t>(Opcode::Footer);
    summary.good_bytes = offset + kRecordPrefixSize + view->content.size();
  }
  summary.complete = ends_with_magic(source, summary.good_bytes, *size);
  if (!summary.complete) {
    summary.problems.push_back(
        {ErrorCode::Unreadable, "the closing MCAP magic is missing", at(source, summary.good_bytes)});
  }
  return summary;
}

}  // namespace waymark::mcap
