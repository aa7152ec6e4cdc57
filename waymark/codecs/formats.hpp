#pragma once
// Internal to the room; shared by the codecs.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/codecs/image_codec.hpp"

namespace waymark::codecs {

/// An encoded image and its name in errors.
struct Input {
  std::span<const std::uint8_t> bytes;
  std::string_view name;

  [[nodiscard]] Place at(std::size_t byte) const {
    return {.source = std::string(name), .byte = static_cast<std::int64_t>(byte)};
  }
  [[nodiscard]] Place whole() const { return {.source = std::string(name)}; }
};

/// Pixels to encode, as rows with `channels` interleaved bytes per pixel; not owned.
struct Pixels {
  const std::uint8_t* data = nullptr;
  int width = 0, height = 0;
  int channels = 1;  ///< 1 for grey, 3 for RGB
  int stride = 0;    ///< [byte]

  [[nodiscard]] const std::uint8_t* row(int y) const {
    return data + static_cast<std::ptrdiff_t>(y) * stride;
  }
};

/// Recognises the format from the content; the error names the apparent file type.
[[nodiscard]] Result<ImageFormat> recognise(const Input& input);

/// Fails (LimitExceeded) if the image has more than max_pixels pixels.
[[nodiscard]] Status check_limit(const ImageInfo& info, const Input& input, const DecodeOptions& options);

/// The error for input that ends before its image is complete.
[[nodiscard]] tl::unexpected<Error> cut_short(const Input& input, std::string message);

/// Decodes an image with the reader of one format: header, limits, pixels.
template <class Reader>
[[nodiscard]] Result<Image> decode_by(Reader& reader, const Input& input, const DecodeOptions& options) {
  const Result<ImageInfo> info = reader.read_header();
  if (!info) return tl::unexpected(info.error());
  if (const Status within = check_limit(*info, input, options); !within)
    return tl::unexpected(within.error());
  if (const Status holds = reader.check_plausible(); !holds) return tl::unexpected(holds.error());
  Image image(info->width, info->height);
  if (const Status read = reader.read_pixels(image, options); !read) return tl::unexpected(read.error());
  return image;
}

/// Result of an encoder.
using Bytes = Result<std::vector<std::uint8_t>>;

// Conversion to grey in integer arithmetic, rounded once.

/// Rec. 601 luma times 1000, for samples up to 65535.
[[nodiscard]] constexpr std::uint64_t luma_1000(std::uint64_t r, std::uint64_t g, std::uint64_t b) {
  return 299 * r + 587 * g + 114 * b;
}

/// round(255 * numerator / denominator).
[[nodiscard]] constexpr std::uint8_t to_byte(std::uint64_t numerator, std::uint64_t denominator) {
  return static_cast<std::uint8_t>((510 * numerator + denominator) / (2 * denominator));
}

/// Grey byte for a sample in 0..max.
[[nodiscard]] constexpr std::uint8_t grey_byte(std::uint64_t value, std::uint64_t max) {
  return to_byte(value, max);
}

/// Grey byte for a colour in 0..max.
[[nodiscard]] constexpr std::uint8_t grey_byte(std::uint64_t r, std::uint64_t g, std::uint64_t b,
                                               std::uint64_t max) {
  return to_byte(luma_1000(r, g, b), 1000 * max);
}

/// Grey byte for luma_1000 composited over white with opacity alpha in 0..max. For 16 bits, 510 * 1000 *
/// max^2 stays below 2^64.
[[nodiscard]] constexpr std::uint8_t grey_byte_over_white(std::uint64_t luma_1000_value, std::uint64_t alpha,
                                                          std::uint64_t max) {
  return to_byte(luma_1000_value * alpha + 1000 * max * (max - alpha), 1000 * max * max);
}

}  // namespace waymark::codecs
