#include "waymark/codecs/image_codec.hpp"

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/codecs/formats.hpp"
#include "waymark/image/image.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using namespace std::string_view_literals;

Image random_image(int width, int height, std::uint64_t seed) {
  Random random(seed);
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<std::uint8_t>(random.index(256));
  }
  return image;
}

/// A smooth image, like a photograph, so that JPEG compresses it well.
Image smooth_image(int width, int height) {
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.row(y)[x] =
          static_cast<std::uint8_t>(std::lround(128 + 60 * std::sin(0.11 * x) + 50 * std::cos(0.07 * y)));
    }
  }
  return image;
}

std::vector<std::uint8_t> bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

Result<Image> decode(std::string_view text) { return decode_image(bytes_of(text), "in"); }

/// The largest difference between two images of the same size.
int largest_difference(const Image& a, const Image& b) {
  int largest = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x)
      largest = std::max(largest, std::abs(int{a.row(y)[x]} - int{b.row(y)[x]}));
  }
  return largest;
}

TEST(RoundTrip, PngAndPnmAreLosslessForAllSizes) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {9, 1}, {31, 17}, {20000, 2}, {3, 20000}}) {
    const Image image = random_image(width, height, static_cast<std::uint64_t>(width));
    for (const auto& bytes : {encode_png(image), encode_pnm(image)}) {
      ASSERT_TRUE(bytes);
      const Result<Image> back = decode_image(*bytes, "in");
      ASSERT_TRUE(back) << to_string(back.error());
      EXPECT_EQ(*back, image);
    }
  }
}

TEST(RoundTrip, JpegStaysNearForAllSizes) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {9, 1}, {63, 41}, {20000, 2}, {3, 20000}}) {
    const Image image = smooth_image(width, height);
    const auto bytes = encode_jpeg(image, 95);
    ASSERT_TRUE(bytes);
    const Result<Image> back = decode_image(*bytes, "in");
    ASSERT_TRUE(back) << to_string(back.error());
    ASSERT_EQ(back->width(), width);
    ASSERT_EQ(back->height(), height);
    EXPECT_LE(largest_difference(*back, image), 5);
  }
}

TEST(RoundTrip, EncodesOnlyTheViewOfAStridedImage) {
  const Image image = random_image(40, 30, 9);
  const ImageView part = crop(image, 11, 5, 13, 8);
  for (const auto& bytes : {encode_png(part), encode_pnm(part)}) {
    const Result<Image> back = decode_image(bytes.value(), "in");
    ASSERT_TRUE(back);
    ASSERT_EQ(back->width(), 13);
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 13; ++x) EXPECT_EQ(back->row(y)[x], part.at(x, y));
    }
  }
}

TEST(RoundTrip, EncodingTheSameTwiceGivesTheSameBytes) {
  const Image image = smooth_image(50, 40);
  EXPECT_EQ(encode_png(image).value(), encode_png(image).value());
  EXPECT_EQ(encode_jpeg(image, 80).value(), encode_jpeg(image, 80).value());
}

TEST(Colour, BecomesRec601Luma) {
  ColorImage color(3, 1);
  color.row(0)[0] = {255, 0, 0};
  color.row(0)[1] = {0, 255, 0};
  color.row(0)[2] = {10, 20, 30};
  for (const auto& bytes : {encode_png(color), encode_pnm(color)}) {
    const Result<Image> grey = decode_image(bytes.value(), "in");
    ASSERT_TRUE(grey);
    EXPECT_EQ(grey->row(0)[0], 76);   // 76.245
    EXPECT_EQ(grey->row(0)[1], 150);  // 149.685
    EXPECT_EQ(grey->row(0)[2], 18);   // 18.15
  }
}

TEST(Colour, JpegKeepsLumaWithinCompressionNoise) {
  for (const Rgb& rgb : {Rgb{200, 40, 90}, Rgb{0, 0, 255}, Rgb{255, 255, 0}}) {
    const Result<Image> grey = decode_image(encode_jpeg(ColorImage(24, 24, rgb), 95).value(), "in");
    ASSERT_TRUE(grey);
    EXPECT_NEAR(grey->row(12)[12], 0.299 * rgb.r + 0.587 * rgb.g + 0.114 * rgb.b, 2.0);
  }
}

TEST(Luma, IsTheNearestByteForEveryDepth) {
  for (const std::uint64_t max : {1U, 3U, 15U, 100U, 255U, 1000U, 65535U}) {
    for (std::uint64_t value = 0; value <= max; ++value) {
      const double exact = 255.0 * static_cast<double>(value) / static_cast<double>(max);
      ASSERT_LE(std::abs(codecs::grey_byte(value, max) - exact), 0.5) << value << " of " << max;
    }
    EXPECT_EQ(codecs::grey_byte(max, max, max, max), 255);
    EXPECT_EQ(codecs::grey_byte_over_white(0, 0, max), 255);
    EXPECT_EQ(codecs::grey_byte_over_white(0, max, max), 0);
    EXPECT_EQ(codecs::grey_byte_over_white(1000 * max, max, max), 255);
  }
}

TEST(Probe, ReadsTheHeader) {
  const Image grey = smooth_image(33, 21);
  const ColorImage color = to_color(grey);
  const auto info = [](const Result<std::vector<std::uint8_t>>& bytes) {
    return probe(bytes.value(), "in").value();
  };
  EXPECT_EQ(info(encode_png(grey)), (ImageInfo{ImageFormat::Png, 33, 21, 1, 8}));
  EXPECT_EQ(info(encode_png(color)), (ImageInfo{ImageFormat::Png, 33, 21, 3, 8}));
  EXPECT_EQ(info(encode_jpeg(grey, 90)), (ImageInfo{ImageFormat::Jpeg, 33, 21, 1, 8}));
  EXPECT_EQ(info(encode_jpeg(color, 90)), (ImageInfo{ImageFormat::Jpeg, 33, 21, 3, 8}));
  EXPECT_EQ(info(encode_pnm(grey)), (ImageInfo{ImageFormat::Pnm, 33, 21, 1, 8}));
  EXPECT_EQ(info(encode_pnm(color)), (ImageInfo{ImageFormat::Pnm, 33, 21, 3, 8}));
  EXPECT_EQ(to_string(ImageFormat::Jpeg), "JPEG");
  EXPECT_EQ(to_string(ImageFormat::Png), "PNG");
  EXPECT_EQ(to_string(ImageFormat::Pnm), "PNM");
}

TEST(Recognition, NamesForeignFormats) {
  const std::pair<std::string_view, const char*> foreign[] = {
      {"GIF89a\1\0\1\0"sv, "GIF"},
      {"RIFF\0\0\0\0WEBPVP8 "sv, "WebP"},
      {"II*\0\0\0\0\0"sv, "TIFF"},
      {"%PDF-1.4\n"sv, "PDF"},
      {"\0\0\0\x18"
       "ftypheic\0\0\0\0"sv,
       "HEIC"},
      {"BM\x36\0\0\0\0\0"sv, "BMP"},
      {"P4\n8 8\n"sv, "PBM"},
      {"version https://git-lfs.github.com/spec/v1\n"sv, "Git LFS pointer"},
  };
  for (const auto& [text, word] : foreign) {
    const Result<Image> image = decode(text);
    ASSERT_FALSE(image);
    EXPECT_EQ(image.error().code, ErrorCode::Unsupported);
    EXPECT_THAT(to_string(image.error()), HasSubstr(word));
    EXPECT_FALSE(image.error().hint.empty());
    testing::expect_on_page("files", image.error());
    EXPECT_FALSE(probe(bytes_of(text), "in"));
  }
}

TEST(Recognition, EmptyAndUnknownInputIsUnreadable) {
  EXPECT_EQ(decode("").error().code, ErrorCode::Unreadable);
  testing::expect_on_page("files", decode("").error());
  testing::expect_on_page("files", decode("hello world").error());
  for (const std::string_view text :
       {"hello world"sv, "\0\0\0\0\0\0\0\0\0\0"sv, "\xff"sv, "\xff\xd8"sv, "\x89PN"sv, "P"sv, "P5"sv}) {
    const Result<Image> image = decode(text);
    ASSERT_FALSE(image);
    EXPECT_EQ(image.error().code, ErrorCode::Unreadable);
    EXPECT_EQ(image.error().place.source, "in");
    EXPECT_TRUE(image.error().place.byte);
  }
}

TEST(Limits, MorePixelsThanAllowedAreRejected) {
  const Image image = smooth_image(100, 50);
  for (const auto& bytes : {encode_png(image), encode_jpeg(image, 90), encode_pnm(image)}) {
    EXPECT_TRUE(decode_image(bytes.value(), "in", {.max_pixels = 5000}));
    const Result<Image> refused = decode_image(bytes.value(), "in", {.max_pixels = 4999});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
    EXPECT_THAT(refused.error().message, HasSubstr("100 x 50"));
    testing::expect_on_page("files", refused.error());
  }
  EXPECT_EQ(decode_image(encode_png(image).value(), "in", {.max_pixels = 0}).error().code,
            ErrorCode::InvalidArgument);
}

TEST(Encode, RejectsInvalidInput) {
  const Image image = smooth_image(8, 8);
  EXPECT_EQ(encode_png(Image()).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(encode_jpeg(ColorImage(), 90).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(encode_pnm(ImageView()).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(encode_jpeg(image, 0).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(encode_jpeg(image, 101).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(encode_jpeg(Image(70000, 1), 90).error().code, ErrorCode::Unsupported);
}

}  // namespace
}  // namespace waymark
