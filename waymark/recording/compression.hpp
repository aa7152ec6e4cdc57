#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/byte_io.hpp"

namespace waymark {

/// What a file that is packed as a whole (.bz2, .gz, .zst) may unpack to. It goes to a temporary file, which
/// has no name: however this process ends, the disk has the room again.
struct UnpackLimits {
  std::uint64_t max_bytes = std::uint64_t{1} << 35;
  /// Recordings shrink to a tenth; a file that grows more than this was made to fill the disk.
  std::uint64_t max_ratio = 200;
  std::uint64_t any_ratio_bytes = std::uint64_t{1} << 28;  ///< up to here the ratio does not matter
  std::uint64_t keep_free_bytes = std::uint64_t{1} << 28;  ///< of the disk that has the temporary folder
  /// Asked after each piece; true ends it with an error.
  std::function<bool()> stop = [] { return false; };

  /// The most bytes that so many packed ones may become.
  [[nodiscard]] std::uint64_t most(std::uint64_t packed_bytes) const {
    const std::uint64_t by_ratio =
        packed_bytes > max_bytes / max_ratio ? max_bytes : packed_bytes * max_ratio;
    const std::uint64_t allowed = by_ratio < any_ratio_bytes ? any_ratio_bytes : by_ratio;
    return allowed < max_bytes ? allowed : max_bytes;
  }
};

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

/// How bytes are packed.
enum class Packing : std::uint8_t { None, Bzip2, Gzip, Zstd, Lz4 };

/// "bzip2", "gzip", …
[[nodiscard]] const char* to_string(Packing packing);

/// What a file is packed with, by its first bytes (bzip2, gzip and zstd; None for anything else).
[[nodiscard]] Packing packing_of(ByteSpan head);

/// Unpacks a stream piece by piece: give() takes packed bytes in order and gives what they unpack to. Streams
/// that follow each other in one file (as pbzip2 writes them) are one. Memory: a window of the packing.
class Unpacker {
 public:
  using Sink = std::function<Status(ByteSpan)>;

  static Result<std::unique_ptr<Unpacker>> make(Packing packing);
  virtual ~Unpacker() = default;
  Unpacker(const Unpacker&) = delete;
  Unpacker& operator=(const Unpacker&) = delete;

  /// Fails on damage, or when the sink does; what came before has been given.
  virtual Status give(ByteSpan packed, const Sink& sink) = 0;
  /// Whether the bytes so far end where a stream ends.
  [[nodiscard]] virtual bool complete() const = 0;

 protected:
  Unpacker() = default;
};

/// A part that was unpacked and why there is not more.
struct UnpackedBytes {
  Bytes bytes{};
  std::optional<Error> damage{};
};

/// Unpacks in memory; stops with damage at more than `max` bytes. What precedes damage is kept.
[[nodiscard]] UnpackedBytes unpack_bytes(Packing packing, ByteSpan packed, std::uint64_t max);

/// A file that was unpacked, and what was wrong with its packing (the bytes before that are there).
struct UnpackedFile {
  std::unique_ptr<ByteSource> source{};
  std::optional<Error> damage{};
};

/// Unpacks a whole file into a temporary one. The place of damage is a byte of the packed file.
[[nodiscard]] Result<UnpackedFile> unpack_file(const ByteSource& packed, Packing packing,
                                               const UnpackLimits& limits);

/// Where the bytes of an unpacked file lie; nullptr for any other source.
[[nodiscard]] std::shared_ptr<const TemporaryFile> unpacked_to(const ByteSource& source);

}  // namespace waymark
