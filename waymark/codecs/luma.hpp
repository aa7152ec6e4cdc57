#pragma once
// Inside the room: one formula for grey, in whole numbers, rounded once.

#include <cstdint>

namespace waymark::codecs {

/// Rec. 601 luma times 1000. Samples up to 65535.
[[nodiscard]] constexpr std::uint64_t luma_1000(std::uint64_t r, std::uint64_t g, std::uint64_t b) {
  return 299 * r + 587 * g + 114 * b;
}

/// round(255 * numerator / denominator).
[[nodiscard]] constexpr std::uint8_t to_byte(std::uint64_t numerator, std::uint64_t denominator) {
  return static_cast<std::uint8_t>((510 * numerator + denominator) / (2 * denominator));
}

/// Grey byte of a sample 0..max.
[[nodiscard]] constexpr std::uint8_t grey_byte(std::uint64_t value, std::uint64_t max) {
  return to_byte(value, max);
}

/// Grey byte of a colour 0..max.
[[nodiscard]] constexpr std::uint8_t grey_byte(std::uint64_t r, std::uint64_t g, std::uint64_t b,
                                               std::uint64_t max) {
  return to_byte(luma_1000(r, g, b), 1000 * max);
}

/// Grey byte of luma_1000 over white with opacity alpha 0..max. 510 * 1000 * max^2 stays below 2^64 for 16
/// bits.
[[nodiscard]] constexpr std::uint8_t grey_byte_over_white(std::uint64_t luma_1000_value, std::uint64_t alpha,
                                                          std::uint64_t max) {
  return to_byte(luma_1000_value * alpha + 1000 * max * (max - alpha), 1000 * max * max);
}

}  // namespace waymark::codecs
