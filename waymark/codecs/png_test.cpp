#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/codecs/formats.hpp"
#include "waymark/codecs/image_codec.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

/// A PNG of any kind, written by libpng from rows as stored in a PNG (16 bits big-endian).
struct Recipe {
  int width = 0, height = 0;
  int color_type = PNG_COLOR_TYPE_GRAY;
  int depth = 8;
  bool interlaced = false;
  std::vector<png_color> palette = {};
  Bytes palette_alpha = {};
  std::optional<std::uint16_t> transparent_grey = {};
};

Bytes write(const Recipe& recipe, const Bytes& rows) {
  Bytes bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  const auto append = [](png_structp p, png_bytep data, png_size_t count) {
    auto& to = *static_cast<Bytes*>(png_get_io_ptr(p));
    to.insert(to.end(), data, data + count);
  };
  png_set_write_fn(png, &bytes, append, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(recipe.width), static_cast<png_uint_32>(recipe.height),
               recipe.depth, recipe.color_type, recipe.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (!recipe.palette.empty())
    png_set_PLTE(png, info, recipe.palette.data(), static_cast<int>(recipe.palette.size()));
  png_color_16 grey{};
  grey.gray = recipe.transparent_grey.value_or(0);
  if (recipe.transparent_grey) png_set_tRNS(png, info, nullptr, 0, &grey);
  if (!recipe.palette_alpha.empty()) {
    png_set_tRNS(png, info, recipe.palette_alpha.data(), static_cast<int>(recipe.palette_alpha.size()),
                 nullptr);
  }
  const std::size_t row_bytes = rows.size() / static_cast<std::size_t>(recipe.height);
  std::vector<png_bytep> pointers(static_cast<std::size_t>(recipe.height));
  Bytes copy = rows;
  for (std::size_t y = 0; y < pointers.size(); ++y) pointers[y] = copy.data() + y * row_bytes;
  png_set_rows(png, info, pointers.data());
  png_write_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

Bytes random_bytes(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  Bytes bytes(count);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.index(256));
  return bytes;
}

std::vector<int> first_row(const Bytes& png) {
  const Result<Image> image = decode_image(png, "in.png");
  std::vector<int> row;
  if (!image) {
    ADD_FAILURE() << to_string(image.error());
    return row;
  }
  for (int x = 0; x < image->width(); ++x) row.push_back(image->row(0)[x]);
  return row;
}

TEST(Png, SixteenBitsRoundToTheNearestByte) {
  const Bytes row = {0, 0, 0x00, 0x80, 0x00, 0x81, 0x7f, 0xff, 0xff, 0xff};
  EXPECT_EQ(first_row(write({.width = 5, .height = 1, .depth = 16}, row)), (std::vector{0, 0, 1, 127, 255}));
  const Bytes color = {0xff, 0xff, 0, 0, 0, 0};
  EXPECT_EQ(first_row(write({.width = 1, .height = 1, .color_type = PNG_COLOR_TYPE_RGB, .depth = 16}, color)),
            (std::vector{76}));
}

TEST(Png, FewBitsSpanBlackToWhite) {
  EXPECT_EQ(first_row(write({.width = 4, .height = 1, .depth = 1}, {0b01100000})),
            (std::vector{0, 255, 255, 0}));
  EXPECT_EQ(first_row(write({.width = 4, .height = 1, .depth = 2}, {0b00011011})),
            (std::vector{0, 85, 170, 255}));
  EXPECT_EQ(first_row(write({.width = 2, .height = 1, .depth = 4}, {0x1f})), (std::vector{17, 255}));
}

TEST(Png, PalettesAreLookedUp) {
  Recipe recipe{.width = 3, .height = 1, .color_type = PNG_COLOR_TYPE_PALETTE, .depth = 2};
  recipe.palette = {{255, 0, 0}, {10, 20, 30}, {255, 255, 255}};
  EXPECT_EQ(first_row(write(recipe, {0b00011000})), (std::vector{76, 18, 255}));
  recipe.palette_alpha = {0, 255};  // the first is fully transparent, so it is rendered white
  EXPECT_EQ(first_row(write(recipe, {0b00011000})), (std::vector{255, 18, 255}));
}

TEST(Png, TransparencyIsCompositedOverWhite) {
  const Bytes grey_alpha = {100, 255, 100, 0, 0, 128};
  EXPECT_EQ(first_row(write({.width = 3, .height = 1, .color_type = PNG_COLOR_TYPE_GRAY_ALPHA}, grey_alpha)),
            (std::vector{100, 255, 127}));
  const Bytes rgba = {10, 20, 30, 255, 10, 20, 30, 0};
  EXPECT_EQ(first_row(write({.width = 2, .height = 1, .color_type = PNG_COLOR_TYPE_RGB_ALPHA}, rgba)),
            (std::vector{18, 255}));
  const Bytes rgba16 = {0, 0, 0, 0, 0, 0, 0x80, 0x00};
  EXPECT_EQ(first_row(write({.width = 1, .height = 1, .color_type = PNG_COLOR_TYPE_RGB_ALPHA, .depth = 16},
                            rgba16)),
            (std::vector{127}));  // 127.498
  const Recipe keyed{.width = 2, .height = 1, .transparent_grey = 7};
  EXPECT_EQ(first_row(write(keyed, {7, 8})), (std::vector{255, 8}));
}

TEST(Png, InterlacedDecodesToTheSameImageForAllSizes) {
  for (const auto& [width, height] : {std::pair{1, 1}, {2, 3}, {4, 1}, {5, 5}, {8, 8}, {9, 17}, {33, 20}}) {
    for (const int depth : {8, 16}) {
      const int samples = 4 * width * height;
      const auto count = static_cast<std::size_t>(depth / 8) * static_cast<std::size_t>(samples);
      Recipe recipe{.width = width, .height = height, .color_type = PNG_COLOR_TYPE_RGB_ALPHA, .depth = depth};
      const Bytes rows = random_bytes(count, static_cast<std::uint64_t>(width));
      const Bytes plain = write(recipe, rows);
      recipe.interlaced = true;
      const Bytes interlaced = write(recipe, rows);
      ASSERT_NE(plain, interlaced);
      const Result<Image> a = decode_image(plain, "plain");
      const Result<Image> b = decode_image(interlaced, "interlaced");
      ASSERT_TRUE(a && b);
      EXPECT_EQ(*a, *b) << width << " x " << height;
    }
  }
}

TEST(Png, ProbeReportsTheStoredFormat) {
  Recipe palette{.width = 3, .height = 2, .color_type = PNG_COLOR_TYPE_PALETTE, .depth = 4};
  palette.palette = {{1, 2, 3}};
  EXPECT_EQ(probe(write(palette, {0, 0, 0, 0}), "in").value(), (ImageInfo{ImageFormat::Png, 3, 2, 1, 4}));
  const Recipe rgba{.width = 1, .height = 1, .color_type = PNG_COLOR_TYPE_RGB_ALPHA, .depth = 16};
  EXPECT_EQ(probe(write(rgba, Bytes(8)), "in").value(), (ImageInfo{ImageFormat::Png, 1, 1, 4, 16}));
}

TEST(Png, TruncationAnywhereIsAnError) {
  for (const bool interlaced : {false, true}) {
    const Bytes whole = write({.width = 20, .height = 12, .interlaced = interlaced}, random_bytes(240, 1));
    for (std::size_t length = 0; length < whole.size(); ++length) {
      const Result<Image> image = decode_image(std::span(whole).first(length), "in.png");
      ASSERT_FALSE(image) << length << " of " << whole.size();
      EXPECT_EQ(image.error().code, ErrorCode::Unreadable);
      if (length > 0) {
        EXPECT_THAT(to_string(image.error()), HasSubstr("truncated"));
        EXPECT_EQ(image.error().place.byte, static_cast<std::int64_t>(length));
      }
    }
  }
}

TEST(Png, EveryFlippedBitIsDetected) {
  // The file has only critical chunks, each with a checksum.
  const Bytes whole = write({.width = 9, .height = 5}, random_bytes(45, 2));
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    Bytes flipped = whole;
    flipped[bit / 8] = static_cast<std::uint8_t>(flipped[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_FALSE(decode_image(flipped, "in.png")) << "bit " << bit;
  }
}

TEST(Png, AChecksumErrorHasItsPlace) {
  Bytes bytes = write({.width = 9, .height = 5}, random_bytes(45, 2));
  bytes[45] = static_cast<std::uint8_t>(bytes[45] ^ 1U);  // inside the first data chunk
  const Result<Image> image = decode_image(bytes, "in.png");
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, ErrorCode::Unreadable);
  EXPECT_EQ(image.error().place.source, "in.png");
  EXPECT_TRUE(image.error().place.byte);
  testing::expect_on_page("files", image.error());
}

/// Sets the width and height of a PNG and recomputes the checksum of its header.
Bytes with_size(Bytes png, std::uint32_t width, std::uint32_t height) {
  const auto put = [&](std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) png[at + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
  };
  put(16, width);
  put(20, height);
  std::uint32_t crc = 0xffffffffU;  // computed over type and content
  for (std::size_t i = 12; i < 29; ++i) {
    crc ^= png[i];
    for (int k = 0; k < 8; ++k) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
  }
  put(29, ~crc);
  return png;
}

TEST(Png, AHugeClaimedSizeIsRejectedBeforeAllocation) {
  const Bytes png = write({.width = 9, .height = 5}, random_bytes(45, 3));
  ASSERT_TRUE(decode_image(with_size(png, 9, 5), "in.png"));
  EXPECT_EQ(decode_image(with_size(png, 0x7fffffff, 0x7fffffff), "in").error().code,
            ErrorCode::LimitExceeded);
  EXPECT_EQ(decode_image(with_size(png, 60000, 60000), "in").error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(decode_image(with_size(png, 20000, 20000), "in").error().code, ErrorCode::Unreadable);
  EXPECT_EQ(decode_image(with_size(png, 40000, 40000), "in", {.max_pixels = 2147483647}).error().code,
            ErrorCode::Unreadable);
  EXPECT_EQ(decode_image(with_size(png, 0x80000000, 5), "in").error().code, ErrorCode::Unreadable);
  EXPECT_EQ(decode_image(with_size(png, 0, 5), "in").error().code, ErrorCode::Unreadable);
}

TEST(Png, ALargeUniformImageIsAccepted) {
  const Image image(5000, 4000, 200);  // deflate's best case
  const auto bytes = encode_png(image);
  ASSERT_TRUE(bytes);
  EXPECT_EQ(decode_image(*bytes, "in").value(), image);
}

TEST(Png, NothingIsPrinted) {
  ::testing::internal::CaptureStderr();
  const Bytes whole = write({.width = 20, .height = 12}, random_bytes(240, 4));
  Random random(6);
  for (int i = 0; i < 200; ++i) {
    Bytes damaged = whole;
    for (int k = 0; k < 3; ++k)
      damaged[random.index(damaged.size())] = static_cast<std::uint8_t>(random.index(256));
    (void)decode_image(damaged, "in");
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace waymark
