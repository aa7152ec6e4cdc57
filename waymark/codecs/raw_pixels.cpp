#include "waymark/codecs/raw_pixels.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/codecs/formats.hpp"

namespace waymark {
namespace {

enum class PixelKind : std::uint8_t { Grey8, Grey16, Colour, Bayer8, Bayer16 };

struct PixelLayout {
  std::string_view encoding;
  int bytes = 1;  ///< bytes per pixel in the first plane
  PixelKind kind = PixelKind::Grey8;
  int first = 0;  ///< Grey8: offset of the grey byte; Colour: offset of the red byte
  int blue = 0;   ///< Colour: offset of the blue byte
  int red_x = 0;  ///< Bayer: column and row of the first red pixel
  int red_y = 0;
};

constexpr std::array kPixelLayouts = {
    PixelLayout{"mono8", 1},
    PixelLayout{"8UC1", 1},
    PixelLayout{"mono16", 2, PixelKind::Grey16},
    PixelLayout{"16UC1", 2, PixelKind::Grey16},
    PixelLayout{"rgb8", 3, PixelKind::Colour, 0, 2},
    PixelLayout{"bgr8", 3, PixelKind::Colour, 2, 0},
    PixelLayout{"8UC3", 3, PixelKind::Colour, 2, 0},
    PixelLayout{"rgba8", 4, PixelKind::Colour, 0, 2},
    PixelLayout{"bgra8", 4, PixelKind::Colour, 2, 0},
    PixelLayout{"8UC4", 4, PixelKind::Colour, 2, 0},
    PixelLayout{"uyvy", 2, PixelKind::Grey8, 1},
    PixelLayout{"yuv422", 2, PixelKind::Grey8, 1},  // the older name of uyvy
    PixelLayout{"yuyv", 2, PixelKind::Grey8, 0},
    PixelLayout{"yuv422_yuy2", 2, PixelKind::Grey8, 0},  // the older name of yuyv
    PixelLayout{"nv12", 1},                              // first the Y plane, then a colour plane
    PixelLayout{"nv21", 1},
    PixelLayout{"nv24", 1},
    PixelLayout{"bayer_rggb8", 1, PixelKind::Bayer8, 0, 0, 0, 0},
    PixelLayout{"bayer_grbg8", 1, PixelKind::Bayer8, 0, 0, 1, 0},
    PixelLayout{"bayer_gbrg8", 1, PixelKind::Bayer8, 0, 0, 0, 1},
    PixelLayout{"bayer_bggr8", 1, PixelKind::Bayer8, 0, 0, 1, 1},
    PixelLayout{"bayer_rggb16", 2, PixelKind::Bayer16, 0, 0, 0, 0},
    PixelLayout{"bayer_grbg16", 2, PixelKind::Bayer16, 0, 0, 1, 0},
    PixelLayout{"bayer_gbrg16", 2, PixelKind::Bayer16, 0, 0, 0, 1},
    PixelLayout{"bayer_bggr16", 2, PixelKind::Bayer16, 0, 0, 1, 1},
};

Result<PixelLayout> layout_of(std::string_view encoding) {
  for (const PixelLayout& layout : kPixelLayouts)
    if (layout.encoding == encoding) return layout;
  return fail(ErrorCode::Unsupported, fmt::format("unsupported image encoding '{}'", encoding),
              {.key = "encoding"},
              fmt::format("Supported: {}, and compressed JPEG or PNG.", fmt::join(raw_encodings(), ", ")));
}

Status check_bytes(const RawPixels& pixels, const PixelLayout& layout) {
  constexpr int kMaxSide = 1 << 20;
  const std::uint64_t row =
      static_cast<std::uint64_t>(std::max(pixels.width, 0)) * static_cast<unsigned>(layout.bytes);
  const bool sized = pixels.width > 0 && pixels.height > 0 && pixels.width <= kMaxSide &&
                     pixels.height <= kMaxSide && pixels.row_bytes >= row &&
                     pixels.row_bytes <= std::uint64_t{1} << 32U;
  const std::uint64_t needed =
      sized ? std::uint64_t{pixels.row_bytes} * static_cast<unsigned>(pixels.height - 1) + row : 0;
  if (sized && pixels.bytes.size() >= needed) return {};
  return fail(
      ErrorCode::Unreadable,
      fmt::format("inconsistent image of {} x {} px in {} with {} bytes per row and {} in total",
                  pixels.width, pixels.height, pixels.encoding, pixels.row_bytes, pixels.bytes.size()));
}

const std::uint8_t* row_of(const RawPixels& pixels, int y) {
  return pixels.bytes.data() + pixels.row_bytes * static_cast<std::size_t>(y);
}

void fill_bytes(const RawPixels& pixels, const PixelLayout& layout, Image& to) {
  for (int y = 0; y < to.height(); ++y) {
    const std::uint8_t* from = row_of(pixels, y);
    std::uint8_t* grey = to.row(y);
    if (layout.kind == PixelKind::Colour) {
      for (int x = 0; x < to.width(); ++x, from += layout.bytes)
        grey[x] = codecs::grey_byte(from[layout.first], from[1], from[layout.blue], 255);
    } else {
      for (int x = 0; x < to.width(); ++x, from += layout.bytes) grey[x] = from[layout.first];
    }
  }
}

std::vector<std::uint16_t> wide_samples(const RawPixels& pixels) {
  std::vector<std::uint16_t> samples;
  samples.reserve(static_cast<std::size_t>(pixels.width) * static_cast<std::size_t>(pixels.height));
  const int high = pixels.big_endian ? 0 : 1;
  for (int y = 0; y < pixels.height; ++y) {
    const std::uint8_t* from = row_of(pixels, y);
    for (int x = 0; x < pixels.width; ++x, from += 2)
      samples.push_back(static_cast<std::uint16_t>(from[high] * 256U + from[1 - high]));
  }
  return samples;
}

/// Luma of the 2 x 2 pixels at (x, y), or of the last ones in the image: one red, two green and one blue.
std::uint8_t bayer_luma(const Image& raw, const PixelLayout& layout, int x, int y) {
  x = std::min(x, raw.width() - 2);
  y = std::min(y, raw.height() - 2);
  unsigned thousandths = 0;
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const bool red_column = ((x + dx + layout.red_x) & 1) == 0;
      const bool red_row = ((y + dy + layout.red_y) & 1) == 0;
      const unsigned weight = red_column && red_row ? 299 : !red_column && !red_row ? 114 : 0;
      const unsigned green = red_column != red_row ? 587 : 0;
      thousandths += (2 * weight + green) * raw.row(y + dy)[x + dx];
    }
  }
  return static_cast<std::uint8_t>((thousandths + 1000U) / 2000U);
}

/// Converts a Bayer pattern to grey. Each group of 2 x 2 pixels that contains a pixel is centred half a pixel
/// away from it; the mean of all four groups is centred on the pixel.
Image without_mosaic(const Image& raw, const PixelLayout& layout) {
  if (raw.width() < 2 || raw.height() < 2) return raw;
  Image grey(raw.width(), raw.height());
  for (int y = 0; y < raw.height(); ++y) {
    for (int x = 0; x < raw.width(); ++x) {
      unsigned sum = 0;
      for (const int dy : {-1, 0})
        for (const int dx : {-1, 0}) sum += bayer_luma(raw, layout, std::max(x + dx, 0), std::max(y + dy, 0));
      grey.row(y)[x] = static_cast<std::uint8_t>((sum + 2U) / 4U);
    }
  }
  return grey;
}

/// Lowest and highest sample. A ten-thousandth of the samples at either end is ignored (hot and dead pixels).
struct UsedRange {
  unsigned low = 0, high = 65535;
};

UsedRange used_range(std::span<const std::uint16_t> samples) {
  std::vector<std::uint32_t> counts(65536, 0);
  for (const std::uint16_t sample : samples) ++counts[sample];
  const std::size_t outliers = samples.size() / 10'000;
  const auto reach = [&](auto begin, auto end) {
    std::size_t seen = 0;
    unsigned at = 0;
    for (auto count = begin; count != end; ++count, ++at) {
      seen += *count;
      if (seen > outliers) break;
    }
    return at;
  };
  return {reach(counts.begin(), counts.end()), 65535U - reach(counts.rbegin(), counts.rend())};
}

}  // namespace

std::vector<std::string> raw_encodings() {
  std::vector<std::string> names;
  names.reserve(std::size(kPixelLayouts));
  for (const PixelLayout& layout : kPixelLayouts) names.emplace_back(layout.encoding);
  return names;
}

Status check_raw_encoding(std::string_view encoding) {
  const Result<PixelLayout> layout = layout_of(encoding);
  return layout ? Status() : tl::unexpected(layout.error());
}

void narrow_grey(std::span<const std::uint16_t> samples, Image& to) {
  constexpr unsigned kFull = 65535;
  constexpr unsigned kNarrow = 8192;  // an eighth
  constexpr unsigned kLow = 5;
  constexpr unsigned kHigh = 250;
  constexpr unsigned kMinSpan = 64;  // a smaller range is the noise of a uniform image
  if (to.empty()) return;
  const UsedRange used = used_range(samples);
  const unsigned span = used.high > used.low ? used.high - used.low : 0;
  const bool stretched = span >= kMinSpan && span < kNarrow;
  std::uint8_t* grey = to.row(0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (stretched) {
      const unsigned above = std::clamp<unsigned>(samples[i], used.low, used.high) - used.low;
      grey[i] = static_cast<std::uint8_t>(kLow + (above * (kHigh - kLow) + span / 2) / span);
    } else {
      grey[i] = codecs::grey_byte(samples[i], kFull);
    }
  }
}

Result<Image> grey_of(const RawPixels& pixels) {
  const Result<PixelLayout> layout = layout_of(pixels.encoding);
  if (!layout) return tl::unexpected(layout.error());
  if (Status sound = check_bytes(pixels, *layout); !sound) return tl::unexpected(sound.error());
  Image image(pixels.width, pixels.height);
  if (layout->kind == PixelKind::Grey16 || layout->kind == PixelKind::Bayer16)
    narrow_grey(wide_samples(pixels), image);
  else
    fill_bytes(pixels, *layout, image);
  const bool mosaic = layout->kind == PixelKind::Bayer8 || layout->kind == PixelKind::Bayer16;
  if (mosaic) return without_mosaic(image, *layout);
  return image;
}

}  // namespace waymark
