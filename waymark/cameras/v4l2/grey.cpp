#include "waymark/cameras/v4l2/grey.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "waymark/codecs/image_codec.hpp"

namespace waymark {
namespace {

constexpr std::array kNames = {
    std::pair{PixelFormat::Grey, "GREY"}, std::pair{PixelFormat::Nv12, "NV12"},
    std::pair{PixelFormat::Yuyv, "YUYV"}, std::pair{PixelFormat::Uyvy, "UYVY"},
    std::pair{PixelFormat::Mjpg, "MJPG"},
};

/// Every second byte of a row, from the first or the second on.
void take_luma(const std::uint8_t* from, std::uint8_t* to, int width) {
  for (int x = 0; x < width; ++x) to[x] = from[2 * x];
}

Result<Image> from_jpeg(std::span<const std::uint8_t> bytes, const RawLayout& layout) {
  const DecodeOptions options{.max_pixels = std::int64_t{layout.width} * layout.height};
  Result<Image> image = decode_image(bytes, "picture of the camera", options);
  if (!image) return image;
  if (image->width() == layout.width && image->height() == layout.height) return image;
  return fail(ErrorCode::Unreadable,
              fmt::format("a picture of {} x {} px came where {} x {} was agreed", image->width(),
                          image->height(), layout.width, layout.height));
}

}  // namespace

const char* to_string(PixelFormat format) {
  return std::ranges::find(kNames, format, [](const auto& one) { return one.first; })->second;
}

std::optional<PixelFormat> pixel_format_named(std::string_view name) {
  for (const auto& [format, word] : kNames)
    if (name == word) return format;
  return std::nullopt;
}

std::vector<std::string> pixel_format_names() {
  std::vector<std::string> names;
  for (const auto& [format, word] : kNames) names.emplace_back(word);
  return names;
}

std::size_t bytes_of(const RawLayout& layout) {
  const auto plane = static_cast<std::size_t>(layout.stride) * static_cast<std::size_t>(layout.height);
  switch (layout.format) {
    case PixelFormat::Mjpg:
      return 0;
    case PixelFormat::Nv12:
      return plane + plane / 2;
    default:
      return plane;
  }
}

Result<Image> to_grey(std::span<const std::uint8_t> bytes, const RawLayout& layout) {
  if (layout.format == PixelFormat::Mjpg) return from_jpeg(bytes, layout);
  // A driver may leave out what follows the last pixel of the last row.
  const bool packed = layout.format == PixelFormat::Yuyv || layout.format == PixelFormat::Uyvy;
  const auto row_bytes = static_cast<std::size_t>(layout.width) * (packed ? 2 : 1);
  const std::size_t padding = static_cast<std::size_t>(layout.stride) - row_bytes;
  if (bytes.size() + padding < bytes_of(layout))
    return fail(ErrorCode::Unreadable,
                fmt::format("the picture ends after {} of {} bytes", bytes.size(), bytes_of(layout)));
  Image image(layout.width, layout.height);
  for (int y = 0; y < layout.height; ++y) {
    const std::uint8_t* row = bytes.data() + static_cast<std::ptrdiff_t>(y) * layout.stride;
    if (packed)
      take_luma(row + (layout.format == PixelFormat::Uyvy ? 1 : 0), image.row(y), layout.width);
    else
      std::memcpy(image.row(y), row, row_bytes);
  }
  return image;
}

}  // namespace waymark
