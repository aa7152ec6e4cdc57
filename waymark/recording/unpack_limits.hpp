#pragma once

#include <cstdint>
#include <functional>

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

}  // namespace waymark
