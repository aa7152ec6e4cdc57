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

/// Limits on unpacking a file that is packed as a whole (.bz2, .gz, .zst). It is unpacked to an unnamed
/// temporary file, so its disk space is freed even if the process crashes.
struct UnpackLimits {
  std::uint64_t max_bytes = std::uint64_t{1} << 35;
  /// Recordings shrink to about a tenth; a larger ratio than this indicates a decompression bomb.
  std::uint64_t max_ratio = 200;
  std::uint64_t any_ratio_bytes = std::uint64_t{1} << 28;  ///< the ratio is not limited up to this size
  std::uint64_t keep_free_bytes = std::uint64_t{1} << 28;  ///< left free on the disk of the temporary folder
  /// Called after each block; returning true stops unpacking with an error.
  std::function<bool()> stop = [] { return false; };

  /// Largest allowed unpacked size for a given packed size [byte].
  [[nodiscard]] std::uint64_t max_unpacked_bytes(std::uint64_t packed_bytes) const {
    const std::uint64_t by_ratio =
        packed_bytes > max_bytes / max_ratio ? max_bytes : packed_bytes * max_ratio;
    const std::uint64_t allowed = by_ratio < any_ratio_bytes ? any_ratio_bytes : by_ratio;
    return allowed < max_bytes ? allowed : max_bytes;
  }
};

/// Compression of the records in a chunk; the names are those of the MCAP registry ("", "lz4", "zstd").
enum class Compression : std::uint8_t { None, Lz4, Zstd };

[[nodiscard]] Result<Compression> parse_compression(std::string_view name);
[[nodiscard]] std::string_view to_string(Compression compression);

/// Packs bytes and appends the result. Uses zstd level 1, or lz4 frames at the default level, which a small
/// computer can sustain while driving.
[[nodiscard]] Status compress(Compression compression, ByteSpan bytes, Bytes& out);

/// Unpacks exactly `size` bytes into `room`, whose memory is reused. A stream of any other size is an error;
/// never allocates more than `size`. Returns the unpacked bytes, which are in `room`, or `packed` itself if
/// it is not compressed.
[[nodiscard]] Result<ByteSpan> decompress(Compression compression, ByteSpan packed, std::uint64_t size,
                                          Bytes& room);

/// CRC-32 (IEEE 802.3) of bytes, continued from an earlier value.
[[nodiscard]] std::uint32_t crc32(ByteSpan bytes, std::uint32_t earlier = 0);

/// CRC-32 of two consecutive parts, from the CRC-32 of each and the size of the second. O(log size).
[[nodiscard]] std::uint32_t crc32_of_both(std::uint32_t first, std::uint32_t second,
                                          std::uint64_t second_size);

/// Compression applied to a whole file.
enum class Packing : std::uint8_t { None, Bzip2, Gzip, Zstd, Lz4 };

/// "bzip2", "gzip", …
[[nodiscard]] const char* to_string(Packing packing);

/// Detects the compression of a file from its first bytes (bzip2, gzip and zstd; None for anything else).
[[nodiscard]] Packing packing_of(ByteSpan head);

/// Unpacks a stream block by block: give() takes packed bytes in order and passes unpacked bytes to the sink.
/// Concatenated streams (as pbzip2 writes them) count as one. Memory use is bounded by the compression
/// window.
class Unpacker {
 public:
  using Sink = std::function<Status(ByteSpan)>;

  static Result<std::unique_ptr<Unpacker>> make(Packing packing);
  virtual ~Unpacker() = default;
  Unpacker(const Unpacker&) = delete;
  Unpacker& operator=(const Unpacker&) = delete;

  /// Fails on damaged data or if the sink fails; everything before the damage has then been passed to the
  /// sink.
  virtual Status give(ByteSpan packed, const Sink& sink) = 0;
  /// Whether the bytes so far end where a stream ends.
  [[nodiscard]] virtual bool complete() const = 0;

 protected:
  Unpacker() = default;
};

/// Unpacked bytes and, if they are truncated, the reason.
struct UnpackedBytes {
  Bytes bytes{};
  std::optional<Error> damage{};
};

/// Unpacks in memory; exceeding `max` bytes counts as damage. Bytes before the damage are kept.
[[nodiscard]] UnpackedBytes unpack_bytes(Packing packing, ByteSpan packed, std::uint64_t max);

/// An unpacked file and the damage found, if any. The bytes before the damage are available.
struct UnpackedFile {
  std::unique_ptr<ByteSource> source{};
  std::optional<Error> damage{};
};

/// Unpacks a whole file into a temporary file. The location of damage is reported as an offset in the packed
/// file.
[[nodiscard]] Result<UnpackedFile> unpack_file(const ByteSource& packed, Packing packing,
                                               const UnpackLimits& limits);

/// The temporary file of an unpacked source; nullptr for any other source.
[[nodiscard]] std::shared_ptr<const TemporaryFile> unpacked_to(const ByteSource& source);

}  // namespace waymark
