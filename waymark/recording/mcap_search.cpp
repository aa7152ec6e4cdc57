#include "waymark/recording/mcap_search.hpp"

#include <algorithm>
#include <cstddef>

#include "waymark/recording/byte_io.hpp"
#include "waymark/recording/mcap_records.hpp"

namespace waymark::mcap {
namespace {

// Kind and length of the record, start and end time, unpacked size, CRC; then the compression with its
// length, at most "zstd", and the length of the records.
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

}  // namespace

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

}  // namespace waymark::mcap
