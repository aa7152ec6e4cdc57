#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/temporary_file.hpp"
#include "waymark/recording/unpack_limits.hpp"

namespace waymark {

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
