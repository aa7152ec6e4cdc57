#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

// Must be included after <cstddef> and <cstdio>.
#include <jpeglib.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/codecs/image_codec.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

/// A JPEG of any kind, written by libjpeg from interleaved samples.
struct Recipe {
  int width = 0, height = 0;
  int channels = 1;
  J_COLOR_SPACE samples = JCS_GRAYSCALE;
  J_COLOR_SPACE stored = JCS_GRAYSCALE;
  bool progressive = false;
  bool arithmetic = false;
  unsigned restart_interval = 0;
  bool luma_last = false;  ///< one scan per channel, with the first channel in the last scan
};

Bytes write(const Recipe& recipe, const Bytes& samples) {
  jpeg_compress_struct cinfo{};
  jpeg_error_mgr errors{};
  cinfo.err = jpeg_std_error(&errors);
  jpeg_create_compress(&cinfo);
  unsigned char* buffer = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&cinfo, &buffer, &size);
  cinfo.image_width = static_cast<JDIMENSION>(recipe.width);
  cinfo.image_height = static_cast<JDIMENSION>(recipe.height);
  cinfo.input_components = recipe.channels;
  cinfo.in_color_space = recipe.samples;
  jpeg_set_defaults(&cinfo);
  jpeg_set_colorspace(&cinfo, recipe.stored);
  jpeg_set_quality(&cinfo, 95, TRUE);
  if (recipe.progressive) jpeg_simple_progression(&cinfo);
  const jpeg_scan_info scans[] = {{1, {1}, 0, 63, 0, 0}, {1, {2}, 0, 63, 0, 0}, {1, {0}, 0, 63, 0, 0}};
  if (recipe.luma_last) {
    cinfo.scan_info = scans;
    cinfo.num_scans = 3;
  }
  cinfo.arith_code = recipe.arithmetic ? TRUE : FALSE;
  cinfo.restart_interval = recipe.restart_interval;
  jpeg_start_compress(&cinfo, TRUE);
  Bytes copy = samples;
  while (cinfo.next_scanline < cinfo.image_height) {
    JSAMPROW row = copy.data() + std::size_t{cinfo.next_scanline} * cinfo.image_width *
                                     static_cast<unsigned>(recipe.channels);
    jpeg_write_scanlines(&cinfo, &row, 1);
  }
  jpeg_finish_compress(&cinfo);
  Bytes bytes(buffer, buffer + size);
  jpeg_destroy_compress(&cinfo);
  std::free(buffer);
  return bytes;
}

Bytes flat(int pixels, const Bytes& pixel) {
  Bytes samples;
  for (int i = 0; i < pixels; ++i) samples.insert(samples.end(), pixel.begin(), pixel.end());
  return samples;
}

/// A grey image with non-zero coefficients in every block.
Bytes waves(int width, int height) {
  Bytes samples;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      samples.push_back(
          static_cast<std::uint8_t>(std::lround(128 + 70 * std::sin(0.4 * x) * std::cos(0.3 * y))));
    }
  }
  return samples;
}

std::vector<std::pair<const char*, Bytes>> all_kinds() {
  constexpr int kWidth = 43;
  constexpr int kHeight = 29;
  const Bytes grey = waves(kWidth, kHeight);
  Bytes rgb;
  for (const std::uint8_t level : grey) rgb.insert(rgb.end(), {level, level, level});
  const Recipe plain{.width = kWidth, .height = kHeight};
  Recipe progressive = plain;
  progressive.progressive = true;
  Recipe restarts = plain;
  restarts.restart_interval = 2;
  Recipe arithmetic = plain;
  arithmetic.arithmetic = true;
  const Recipe color{
      .width = kWidth, .height = kHeight, .channels = 3, .samples = JCS_RGB, .stored = JCS_YCbCr};
  Recipe progressive_color = color;
  progressive_color.progressive = true;
  return {{"baseline", write(plain, grey)},    {"progressive", write(progressive, grey)},
          {"restarts", write(restarts, grey)}, {"arithmetic", write(arithmetic, grey)},
          {"color", write(color, rgb)},        {"progressive color", write(progressive_color, rgb)}};
}

TEST(Jpeg, EveryKindDecodesToTheSameImage) {
  const Bytes grey = waves(43, 29);
  for (const auto& [kind, bytes] : all_kinds()) {
    const Result<Image> image = decode_image(bytes, kind);
    ASSERT_TRUE(image) << to_string(image.error());
    ASSERT_EQ(image->width(), 43);
    ASSERT_EQ(image->height(), 29);
    for (int y = 0; y < 29; ++y) {
      for (int x = 0; x < 43; ++x) {
        EXPECT_NEAR(image->row(y)[x], grey[static_cast<std::size_t>(43 * y + x)], 6)
            << kind << " at " << x << ", " << y;
      }
    }
  }
}

TEST(Jpeg, ColourSpacesBecomeLuma) {
  const Bytes rgb = flat(16 * 16, {200, 40, 90});
  const double luma = 0.299 * 200 + 0.587 * 40 + 0.114 * 90;
  const Recipe ycc{.width = 16, .height = 16, .channels = 3, .samples = JCS_RGB, .stored = JCS_YCbCr};
  const Recipe plain_rgb{.width = 16, .height = 16, .channels = 3, .samples = JCS_RGB, .stored = JCS_RGB};
  EXPECT_NEAR(decode_image(write(ycc, rgb), "ycc")->row(8)[8], luma, 1.5);
  EXPECT_NEAR(decode_image(write(plain_rgb, rgb), "rgb")->row(8)[8], luma, 1.5);
}

TEST(Jpeg, InksAreInvertedAsAdobeDoes) {
  const Bytes cmyk = flat(16 * 16, {200, 40, 90, 128});  // 255 - ink
  const double luma = (0.299 * 200 + 0.587 * 40 + 0.114 * 90) * 128 / 255;
  for (const J_COLOR_SPACE stored : {JCS_CMYK, JCS_YCCK}) {
    const Bytes bytes =
        write({.width = 16, .height = 16, .channels = 4, .samples = JCS_CMYK, .stored = stored}, cmyk);
    EXPECT_EQ(probe(bytes, "in")->channels, 4);
    EXPECT_NEAR(decode_image(bytes, "in")->row(8)[8], luma, 2.0);
  }
}

TEST(Jpeg, UnknownChannelsAreUnsupported) {
  const Recipe two{.width = 8, .height = 8, .channels = 2, .samples = JCS_UNKNOWN, .stored = JCS_UNKNOWN};
  const Result<Image> image = decode_image(write(two, Bytes(128, 77)), "in.jpg");
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, ErrorCode::Unsupported);
}

TEST(Jpeg, TruncationAnywhereIsAnErrorNeverAGreyImage) {
  for (const auto& [kind, whole] : all_kinds()) {
    for (std::size_t length = 1; length < whole.size(); ++length) {
      const Result<Image> image = decode_image(std::span(whole).first(length), "in.jpg");
      ASSERT_FALSE(image) << kind << ": " << length << " of " << whole.size();
      EXPECT_EQ(image.error().code, ErrorCode::Unreadable);
      EXPECT_THAT(to_string(image.error()), HasSubstr("truncated"));
      EXPECT_EQ(image.error().place.byte, static_cast<std::int64_t>(length));
    }
  }
}

TEST(Jpeg, AMissingPartInTheMiddleIsAnError) {
  // As after an interrupted transfer, only three quarters of the data precede the end marker.
  for (const auto& [kind, whole] : all_kinds()) {
    Bytes half(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(whole.size() * 3 / 4));
    half.insert(half.end(), {0xff, 0xd9});
    const Result<Image> image = decode_image(half, "in.jpg");
    if (std::string_view(kind) == "arithmetic")
      continue;  // an arithmetic decoder may end early by design (T.81 annex D)
    ASSERT_FALSE(image) << kind;
    EXPECT_EQ(image.error().code, ErrorCode::Unreadable);
    testing::expect_on_page("files", image.error());
  }
}

TEST(Jpeg, AMissingChannelIsAnErrorNeverAGreyImage) {
  const Recipe recipe{
      .width = 16, .height = 16, .channels = 3, .samples = JCS_RGB, .stored = JCS_YCbCr, .luma_last = true};
  Bytes bytes = write(recipe, flat(256, {200, 40, 90}));
  ASSERT_TRUE(decode_image(bytes, "in.jpg"));
  std::size_t last_scan = 0;
  for (std::size_t i = 0; i + 1 < bytes.size(); ++i) {
    if (bytes[i] == 0xff && bytes[i + 1] == 0xda) last_scan = i;
  }
  bytes.resize(last_scan);
  bytes.insert(bytes.end(), {0xff, 0xd9});
  const Result<Image> image = decode_image(bytes, "in.jpg");
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, ErrorCode::Unreadable);
  testing::expect_on_page("files", image.error());
}

TEST(Jpeg, StrayBytesAfterTheEndAreHarmless) {
  for (auto [kind, bytes] : all_kinds()) {
    const Image whole = decode_image(bytes, kind).value();
    bytes.insert(bytes.end(), 100, 0);  // padding as sent by webcams
    EXPECT_EQ(decode_image(bytes, kind).value(), whole);
  }
}

TEST(Jpeg, DamagedInputNeverCrashesNorPrints) {
  ::testing::internal::CaptureStderr();
  Random random(7);
  int errors = 0;
  for (const auto& [kind, whole] : all_kinds()) {
    for (int i = 0; i < 400; ++i) {
      Bytes damaged = whole;
      const std::uint64_t flips = 1 + random.index(4);
      for (std::uint64_t k = 0; k < flips; ++k) {
        std::uint8_t& byte = damaged[random.index(damaged.size())];
        byte = static_cast<std::uint8_t>(byte ^ (1U << random.index(8)));
      }
      const Result<Image> image = decode_image(damaged, "in.jpg", {.max_pixels = 1'000'000});
      if (!image) ++errors;
      EXPECT_TRUE(!image || !image->empty());
    }
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_GT(errors, 100);
}

/// Sets the size in the frame header.
Bytes with_size(Bytes jpeg, unsigned width, unsigned height) {
  for (std::size_t i = 2; i + 9 < jpeg.size();) {
    if (jpeg[i + 1] >= 0xc0 && jpeg[i + 1] <= 0xc2) {
      jpeg[i + 5] = static_cast<std::uint8_t>(height >> 8U);
      jpeg[i + 6] = static_cast<std::uint8_t>(height & 0xffU);
      jpeg[i + 7] = static_cast<std::uint8_t>(width >> 8U);
      jpeg[i + 8] = static_cast<std::uint8_t>(width & 0xffU);
      return jpeg;
    }
    i += 2 + (std::size_t{jpeg[i + 2]} << 8U) + jpeg[i + 3];
  }
  ADD_FAILURE() << "no frame header";
  return jpeg;
}

TEST(Jpeg, AHugeClaimedSizeIsRejectedBeforeAllocation) {
  const Bytes jpeg = all_kinds().front().second;
  EXPECT_EQ(decode_image(with_size(jpeg, 65500, 65500), "in").error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(decode_image(with_size(jpeg, 20000, 20000), "in").error().code, ErrorCode::Unreadable);
  EXPECT_EQ(decode_image(with_size(jpeg, 65500, 0), "in").error().code, ErrorCode::Unreadable);
}

TEST(Jpeg, ALargeUniformImageIsAccepted) {
  const Image image(5000, 4000, 200);  // two bits per block
  const Result<Image> back = decode_image(encode_jpeg(image, 90).value(), "in");
  ASSERT_TRUE(back) << to_string(back.error());
  EXPECT_EQ(*back, image);
}

}  // namespace
}  // namespace waymark
