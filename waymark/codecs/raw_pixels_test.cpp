#include "waymark/codecs/raw_pixels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

/// A ramp with noise.
Image some_image(int width, int height) {
  Random random(3);
  Image image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.row(y)[x] = static_cast<std::uint8_t>(40 + 120 * x / width + static_cast<int>(random.index(40)));
  return image;
}

std::vector<std::uint8_t> bytes_of(const Image& image, unsigned offset, unsigned scale) {
  std::vector<std::uint8_t> bytes;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const unsigned value = offset + scale * image.row(y)[x];
      bytes.push_back(static_cast<std::uint8_t>(value & 255U));
      bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
    }
  }
  return bytes;
}

Image grey16(const Image& image, unsigned offset, unsigned scale) {
  const auto bytes = bytes_of(image, offset, scale);
  return grey_of({.encoding = "mono16",
                  .width = image.width(),
                  .height = image.height(),
                  .row_bytes = 2 * static_cast<std::size_t>(image.width()),
                  .bytes = bytes})
      .value();
}

/// The largest difference between two images after `b` is scaled to the extremes of `a`.
double worst_difference(const Image& a, const Image& b) {
  const auto [a_low, a_high] = std::minmax_element(a.row(0), a.row(0) + a.width() * a.height());
  const auto [b_low, b_high] = std::minmax_element(b.row(0), b.row(0) + b.width() * b.height());
  const double scale = static_cast<double>(*a_high - *a_low) / (*b_high - *b_low);
  double worst = 0;
  for (int i = 0; i < a.width() * a.height(); ++i)
    worst = std::max(worst, std::abs((a.row(0)[i] - *a_low) - scale * (b.row(0)[i] - *b_low)));
  return worst;
}

TEST(RawPixels, SixteenBitsThatUseTheirRangeAreScaledExactly) {
  const Image image = some_image(64, 48);
  EXPECT_EQ(grey16(image, 0, 257), image);
}

// A 12-bit sensor, a 10-bit sensor, and a thermal camera with an offset.
TEST(RawPixels, ANarrowRangeIsStretched) {
  const Image image = some_image(64, 48);
  for (const auto& [offset, scale] : {std::pair(0U, 16U), std::pair(0U, 4U), std::pair(21500U, 9U)}) {
    const Image stretched = grey16(image, offset, scale);
    EXPECT_LT(worst_difference(image, stretched), 1.5) << offset << " " << scale;
    EXPECT_GE(*std::min_element(stretched.row(0), stretched.row(0) + 64 * 48), 5);
    EXPECT_LE(*std::max_element(stretched.row(0), stretched.row(0) + 64 * 48), 250);
  }
}

TEST(RawPixels, HotPixelsDoNotAffectTheRange) {
  const Image image = some_image(400, 300);
  const Image without = grey16(image, 0, 4);
  auto bytes = bytes_of(image, 0, 4);
  const std::vector<std::size_t> hot = {100, 20'000, 119'000};
  for (const std::size_t i : hot) bytes[2 * i] = bytes[2 * i + 1] = 255;
  Image with =
      grey_of({.encoding = "mono16", .width = 400, .height = 300, .row_bytes = 800, .bytes = bytes}).value();
  for (const std::size_t i : hot) {
    EXPECT_EQ(with.row(0)[i], 250);
    with.row(0)[i] = without.row(0)[i];
  }
  EXPECT_LT(worst_difference(without, with), 2.5);
}

TEST(RawPixels, AUniformImageStaysDark) {
  const Image image(64, 48, 3);
  EXPECT_EQ(grey16(image, 0, 16), Image(64, 48, 0)) << "the level is 48 of 65535";
}

TEST(RawPixels, ColourPlanesMayBeMissing) {
  const Image image = some_image(32, 16);
  std::vector<std::uint8_t> bytes(image.row(0), image.row(0) + 32 * 16);
  bytes.resize(bytes.size() * 3 / 2, 128);
  for (const char* encoding : {"nv12", "nv21", "nv24"})
    EXPECT_EQ(
        grey_of({.encoding = encoding, .width = 32, .height = 16, .row_bytes = 32, .bytes = bytes}).value(),
        image);
}

TEST(RawPixels, ABayerPatternBecomesLuma) {
  for (const char* encoding : {"bayer_rggb8", "bayer_bggr8", "bayer_grbg8", "bayer_gbrg8"}) {
    const std::vector<std::uint8_t> bytes(32 * 16, 90);
    EXPECT_EQ(
        grey_of({.encoding = encoding, .width = 32, .height = 16, .row_bytes = 32, .bytes = bytes}).value(),
        Image(32, 16, 90))
        << encoding;
  }
  // Red 200, green 100 and blue 50 have the luma 124, wherever the pattern begins.
  for (const auto& [encoding, four] : {std::pair("bayer_rggb8", std::array{200, 100, 100, 50}),
                                       std::pair("bayer_grbg8", std::array{100, 200, 50, 100}),
                                       std::pair("bayer_gbrg8", std::array{100, 50, 200, 100}),
                                       std::pair("bayer_bggr8", std::array{50, 100, 100, 200})}) {
    std::vector<std::uint8_t> bytes(32 * 16);
    for (std::size_t i = 0; i < bytes.size(); ++i)
      bytes[i] = static_cast<std::uint8_t>(four.at(2 * (i / 32 % 2) + i % 2));
    EXPECT_EQ(
        grey_of({.encoding = encoding, .width = 32, .height = 16, .row_bytes = 32, .bytes = bytes}).value(),
        Image(32, 16, 124))
        << encoding;
  }
}

TEST(RawPixels, RejectsUnknownEncodingsAndInconsistentSizes) {
  const std::vector<std::uint8_t> bytes(16);
  const RawPixels sound{.encoding = "mono8", .width = 4, .height = 4, .row_bytes = 4, .bytes = bytes};
  EXPECT_TRUE(grey_of(sound));
  RawPixels wrong = sound;
  wrong.encoding = "32FC1";
  EXPECT_EQ(grey_of(wrong).error().code, ErrorCode::Unsupported);
  wrong = sound;
  wrong.row_bytes = 3;
  EXPECT_EQ(grey_of(wrong).error().code, ErrorCode::Unreadable);
  wrong = sound;
  wrong.height = 5;
  EXPECT_FALSE(grey_of(wrong));
  wrong.height = 0;
  EXPECT_FALSE(grey_of(wrong));
}

}  // namespace
}  // namespace waymark
