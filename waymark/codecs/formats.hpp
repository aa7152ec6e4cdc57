#pragma once
// Inside the room: what the decoders of the single formats share with image_codec.cpp.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/codecs/image_codec.hpp"

namespace waymark::codecs {

/// The bytes of a picture and what to call them in errors.
struct Input {
  std::span<const std::uint8_t> bytes;
  std::string_view name;

  [[nodiscard]] Place at(std::size_t byte) const {
    return {.source = std::string(name), .byte = static_cast<std::int64_t>(byte)};
  }
  [[nodiscard]] Place whole() const { return {.source = std::string(name)}; }
};

/// Rows of `channels` interleaved bytes to encode, whoever owns them.
struct Pixels {
  const std::uint8_t* data = nullptr;
  int width = 0, height = 0;
  int channels = 1;  ///< 1 grey, 3 RGB
  int stride = 0;    ///< [byte]

  [[nodiscard]] const std::uint8_t* row(int y) const {
    return data + static_cast<std::ptrdiff_t>(y) * stride;
  }
};

/// The format by content, or an error that says what the input looks like.
[[nodiscard]] Result<ImageFormat> recognise(const Input& input);

/// LimitExceeded beyond max_pixels.
[[nodiscard]] Status check_limit(const ImageInfo& info, const Input& input, const DecodeOptions& options);

/// The error for input that ends before its picture does.
[[nodiscard]] tl::unexpected<Error> cut_short(const Input& input, std::string message);

[[nodiscard]] Result<ImageInfo> probe_jpeg(const Input& input);
[[nodiscard]] Result<ImageInfo> probe_png(const Input& input);
[[nodiscard]] Result<ImageInfo> probe_pnm(const Input& input);
[[nodiscard]] Result<Image> decode_jpeg(const Input& input, const DecodeOptions& options);
[[nodiscard]] Result<Image> decode_png(const Input& input, const DecodeOptions& options);
[[nodiscard]] Result<Image> decode_pnm(const Input& input, const DecodeOptions& options);

/// A picture by a reader of one format: its header, the limits, its pixels.
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

using Bytes = Result<std::vector<std::uint8_t>>;
[[nodiscard]] Bytes encode_png(const Pixels& pixels);
[[nodiscard]] Bytes encode_jpeg(const Pixels& pixels, int quality);
[[nodiscard]] Bytes encode_pnm(const Pixels& pixels);

}  // namespace waymark::codecs
