#pragma once

#include <cstdint>
#include <optional>

#include "waymark/recording/byte_file.hpp"

namespace waymark::mcap {

/// Where the next chunk begins at `offset` or behind it, by its bytes alone: its kind, and a length that fits
/// the lengths inside it and the file. Nothing where there is none, or the source cannot be read. O(bytes).
[[nodiscard]] std::optional<std::uint64_t> find_chunk(const ByteSource& source, std::uint64_t offset,
                                                      std::uint64_t size);

}  // namespace waymark::mcap
