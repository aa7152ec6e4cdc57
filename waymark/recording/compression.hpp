#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_io.hpp"

namespace waymark {

/// How the records of a chunk are packed; the names are those of the MCAP registry ("", "lz4", "zstd").
enum class Compression : std::uint8_t { None, Lz4, Zstd };

[[nodiscard]] Result<Compression> parse_compression(std::string_view name);
[[nodiscard]] std::string_view to_string(Compression compression);

/// Packs bytes and appends them. zstd at level 1 and lz4 frames at the default level: what a small computer
/// can do while driving.
[[nodiscard]] Status compress(Compression compression, ByteSpan bytes, Bytes& out);

/// Unpacks exactly `size` bytes into `room`, whose memory is used again; a stream that gives more or fewer is
/// an error, and no more than `size` is ever allocated. Gives the bytes: those of `room`, or `packed` itself
/// when nothing is packed.
[[nodiscard]] Result<ByteSpan> decompress(Compression compression, ByteSpan packed, std::uint64_t size,
                                          Bytes& room);

/// CRC-32 (IEEE 802.3) of bytes, continued from an earlier value.
[[nodiscard]] std::uint32_t crc32(ByteSpan bytes, std::uint32_t earlier = 0);

/// CRC-32 of two parts one after the other, from the CRC-32 of each and the size of the second. O(log size).
[[nodiscard]] std::uint32_t crc32_of_both(std::uint32_t first, std::uint32_t second,
                                          std::uint64_t second_size);

}  // namespace waymark
