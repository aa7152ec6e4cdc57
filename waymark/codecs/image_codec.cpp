#include "waymark/codecs/image_codec.hpp"

#include <new>
#include <stdexcept>

#include <fmt/format.h>

#include "waymark/codecs/formats.hpp"
#include "waymark/codecs/jpeg.hpp"
#include "waymark/codecs/png.hpp"
#include "waymark/codecs/pnm.hpp"

namespace waymark {
namespace codecs {

namespace {

Result<Image> decode(const Input& input, const DecodeOptions& options) {
  const Result<ImageFormat> format = recognise(input);
  if (!format) return tl::unexpected(format.error());
  switch (*format) {
    case ImageFormat::Jpeg:
      return decode_jpeg(input, options);
    case ImageFormat::Png:
      return decode_png(input, options);
    case ImageFormat::Pnm:
      break;
  }
  return decode_pnm(input, options);
}

tl::unexpected<Error> out_of_memory(Place place) {
  return fail(ErrorCode::LimitExceeded, "not enough memory for this image", std::move(place),
              "Reduce its size.");
}

/// Converts an out-of-memory exception to an Error, because exceptions must not leave the room.
template <class Work>
auto without_exceptions(const Place& place, Work work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return out_of_memory(place);
  } catch (const std::length_error&) {
    return out_of_memory(place);
  }
}

Pixels pixels_of(const ImageView& image) { return {image.data, image.width, image.height, 1, image.stride}; }
Pixels pixels_of(const ColorImage& image) {
  return {image.empty() ? nullptr : image.row_bytes(0), image.width(), image.height(), 3, 3 * image.width()};
}

/// Encodes a non-empty image.
template <class AnyImage, class Encode>
Bytes encode(const AnyImage& image, Encode encode_pixels) {
  if (image.empty()) return fail(ErrorCode::InvalidArgument, "an empty image cannot be encoded");
  return without_exceptions({}, [&]() -> Bytes { return encode_pixels(pixels_of(image)); });
}

}  // namespace
}  // namespace codecs

std::string_view to_string(ImageFormat format) {
  switch (format) {
    case ImageFormat::Jpeg:
      return "JPEG";
    case ImageFormat::Png:
      return "PNG";
    case ImageFormat::Pnm:
      break;
  }
  return "PNM";
}

std::optional<ImageFormat> image_format_of(std::span<const std::uint8_t> head) {
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  if (text.starts_with("\xff\xd8\xff")) return ImageFormat::Jpeg;
  if (text.starts_with("\x89PNG\r\n\x1a\n")) return ImageFormat::Png;
  const bool pnm =
      text.size() > 2 && text[0] == 'P' && std::string_view("2356").find(text[1]) != std::string_view::npos;
  return pnm ? std::optional(ImageFormat::Pnm) : std::nullopt;
}

Result<ImageInfo> probe(std::span<const std::uint8_t> bytes, std::string_view name) {
  const codecs::Input input{bytes, name};
  return codecs::without_exceptions(input.whole(), [&]() -> Result<ImageInfo> {
    const Result<ImageFormat> format = codecs::recognise(input);
    if (!format) return tl::unexpected(format.error());
    if (*format == ImageFormat::Jpeg) return codecs::probe_jpeg(input);
    if (*format == ImageFormat::Png) return codecs::probe_png(input);
    return codecs::probe_pnm(input);
  });
}

Result<Image> decode_image(std::span<const std::uint8_t> bytes, std::string_view name,
                           const DecodeOptions& options) {
  if (const Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  const codecs::Input input{bytes, name};
  return codecs::without_exceptions(input.whole(), [&] { return codecs::decode(input, options); });
}

Result<std::vector<std::uint8_t>> encode_png(const ImageView& image) {
  return codecs::encode(image, [](const codecs::Pixels& pixels) { return codecs::encode_png(pixels); });
}
Result<std::vector<std::uint8_t>> encode_png(const ColorImage& image) {
  return codecs::encode(image, [](const codecs::Pixels& pixels) { return codecs::encode_png(pixels); });
}
Result<std::vector<std::uint8_t>> encode_jpeg(const ImageView& image, int quality) {
  return codecs::encode(image,
                        [&](const codecs::Pixels& pixels) { return codecs::encode_jpeg(pixels, quality); });
}
Result<std::vector<std::uint8_t>> encode_jpeg(const ColorImage& image, int quality) {
  return codecs::encode(image,
                        [&](const codecs::Pixels& pixels) { return codecs::encode_jpeg(pixels, quality); });
}
Result<std::vector<std::uint8_t>> encode_pnm(const ImageView& image) {
  return codecs::encode(image, [](const codecs::Pixels& pixels) { return codecs::encode_pnm(pixels); });
}
Result<std::vector<std::uint8_t>> encode_pnm(const ColorImage& image) {
  return codecs::encode(image, [](const codecs::Pixels& pixels) { return codecs::encode_pnm(pixels); });
}

}  // namespace waymark
