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

/// Packs bytes. zstd at level 1 and lz4 frames at the default level: what a small computer can do while
/// driving.
[[nodiscard]] Result<Bytes> compress(Compression compression, ByteSpan bytes);

/// Unpacks exactly `size` bytes; a stream that gives more or fewer is an error, and no more than `size` is
/// ever allocated.
[[nodiscard]] Result<Bytes> decompress(Compression compression, ByteSpan packed, std::uint64_t size);

/// CRC-32 (IEEE 802.3) of bytes, continued from an earlier value.
[[nodiscard]] std::uint32_t crc32(ByteSpan bytes, std::uint32_t earlier = 0);

}  // namespace waymark
