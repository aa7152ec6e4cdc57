// Tests of the stamps, conversion and faults of images, without a device.
#include "waymark/cameras/v4l2/images.hpp"

#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/codecs/image_codec.hpp"

namespace waymark {
namespace {

using internal::ImageFaults;
using internal::ImageStamps;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

TEST(ImageStamps, AreAtTheMiddleOfTheExposureForStampsOfStartAndEnd) {
  const Duration exposure = milliseconds(8);
  ImageStamps begins;
  ImageStamps ends;
  for (int i = 1; i <= 20; ++i) {
    const Duration start = milliseconds(1000 + 33 * i);
    const auto by_start = begins.add(start, true, exposure, start + milliseconds(30));
    const auto by_end = ends.add(start + exposure, false, exposure, start + milliseconds(30));
    EXPECT_TRUE(by_start.driver && by_end.driver);
    EXPECT_EQ(by_start.stamp, start + exposure / 2);
    EXPECT_EQ(by_end.stamp, by_start.stamp);
  }
  EXPECT_FALSE(begins.take_reports() || ends.take_reports());
}

// Whatever the driver stamps are, the computed stamps increase and are not later than the arrival.
TEST(ImageStamps, IncreaseForAnyDriverStamps) {
  Random random(20261124);
  for (int trial = 0; trial < 50; ++trial) {
    ImageStamps stamps;
    Duration last{};
    Duration arrived = seconds(100);
    for (int i = 0; i < 200; ++i) {
      arrived += milliseconds(static_cast<int>(random.uniform(1, 60)));
      std::optional<Duration> driver = arrived - milliseconds(static_cast<int>(random.uniform(-5000, 5000)));
      if (random.uniform() < 0.2) driver.reset();
      const auto stamped = stamps.add(driver, random.uniform() < 0.5, std::nullopt, arrived);
      EXPECT_GT(stamped.stamp, last);
      EXPECT_LE(stamped.stamp, arrived + milliseconds(21)) << "no further in the future than a driver's tick";
      last = stamped.stamp;
    }
  }
}

TEST(ImageStamps, ReplaceInvalidStampsByTheArrivalAndReportOnce) {
  const auto report_for = [](std::optional<Duration> driver) {
    ImageStamps stamps;
    (void)stamps.add(seconds(49), false, {}, seconds(49));
    const auto stamped = stamps.add(driver, false, {}, seconds(50));
    EXPECT_FALSE(stamped.driver);
    EXPECT_EQ(stamped.stamp, seconds(50));
    (void)stamps.add(std::nullopt, false, {}, seconds(51));
    std::string report = stamps.take_reports().value_or("");
    EXPECT_FALSE(stamps.take_reports());
    testing::expect_on_page("cameras", report);
    return report;
  };
  const std::set<std::string> reports = {report_for(std::nullopt), report_for(seconds(51)),
                                         report_for(seconds(47)), report_for(seconds(49))};
  EXPECT_EQ(reports.size(), 4U) << "each kind has its own message";
}

Image level(std::uint8_t grey, int noise = 0, std::uint64_t seed = 1) {
  Random random(seed);
  Image image(64, 48);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x)
      image.row(y)[x] = static_cast<std::uint8_t>(grey + static_cast<int>(random.uniform(0, noise + 0.999)));
  return image;
}

TEST(ImageFaults, DetectsACoveredLensButNotADarkRoom) {
  ImageFaults faults;
  EXPECT_THAT(faults.add(level(16, 4).view(), seconds(1), true).value_or(""), HasSubstr("black"));
  EXPECT_FALSE(faults.add(level(16, 4, 2).view(), seconds(2), true)) << "reported once";
  const auto end = faults.add(level(16, 60, 3).view(), seconds(3), true);
  ASSERT_TRUE(end);
  testing::expect_on_page("cameras", *end);
}

TEST(ImageFaults, DistinguishesAFrozenImageFromAStaticSceneWithNoise) {
  ImageFaults moving;
  for (int i = 0; i < 90; ++i)
    EXPECT_FALSE(moving.add(level(100, 2, static_cast<std::uint64_t>(i)).view(), milliseconds(33 * i), true));
  ImageFaults frozen;
  const Image same = level(100, 2);
  int reported_at = -1;
  for (int i = 0; i < 90; ++i)
    if (const auto report = frozen.add(same.view(), milliseconds(33 * i), false)) {
      EXPECT_THAT(*report, HasSubstr("unplug"));
      testing::expect_on_page("cameras", *report);
      reported_at = i;
    }
  EXPECT_GE(33 * reported_at, 1000);
  EXPECT_LE(33 * reported_at, 1100);
}

// A board that moves every two seconds, seen by a noise-free source whose numbers advance.
TEST(ImageFaults, ReportsAStillSourceOnce) {
  ImageFaults faults;
  std::vector<std::string> reports;
  for (int i = 0; i < 600; ++i) {
    const Image image = level(static_cast<std::uint8_t>(100 + i / 60), 2);
    if (auto report = faults.add(image.view(), milliseconds(33 * i), true))
      reports.push_back(*std::move(report));
  }
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_THAT(reports.front(), ::testing::Not(HasSubstr("unplug")));
  testing::expect_on_page("cameras", reports.front());
}

TEST(Grey, EveryRawFormatGivesTheSameLumaWithPaddedRows) {
  const Image expected = level(40, 100);
  for (const std::string& name : pixel_format_names()) {
    const PixelFormat format = pixel_format_named(name).value();
    EXPECT_EQ(to_string(format), name);
    if (format == PixelFormat::Mjpg) continue;
    const bool packed = format == PixelFormat::Yuyv || format == PixelFormat::Uyvy;
    const RawLayout layout{format, 64, 48, (packed ? 128 : 64) + 12};
    std::vector<std::uint8_t> bytes(bytes_of(layout), 0x55);
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x)
        bytes[static_cast<std::size_t>(y * layout.stride + (packed ? 2 * x : x)) +
              (format == PixelFormat::Uyvy ? 1U : 0U)] = expected.row(y)[x];
    const auto grey = to_grey(bytes, layout);
    ASSERT_TRUE(grey) << name;
    for (int y = 0; y < 48; ++y)
      EXPECT_TRUE(std::equal(expected.row(y), expected.row(y) + 64, grey->row(y))) << name << " row " << y;
    bytes.resize(bytes.size() - 13);  // the last row's padding may be missing, but none of its pixels
    EXPECT_FALSE(to_grey(bytes, layout)) << name;
  }
  EXPECT_FALSE(pixel_format_named("H264"));
}

constexpr int kWidth = 64;

constexpr int kHeight = 48;

/// Webcams omit the Huffman tables of the JPEG standard.
TEST(V4l2Grey, DecodesImagesWithoutHuffmanTables) {
  Image image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) image.row(y)[x] = static_cast<std::uint8_t>(40 + 2 * x + y);
  const auto jpeg = encode_jpeg(image, 90);
  ASSERT_TRUE(jpeg);
  std::vector<std::uint8_t> without(jpeg->begin(), jpeg->begin() + 2);
  for (std::size_t at = 2; at + 4 <= jpeg->size() && (*jpeg)[at] == 0xff;) {
    const std::size_t size = 2U + 256U * (*jpeg)[at + 2] + (*jpeg)[at + 3];
    const bool scan = (*jpeg)[at + 1] == 0xda;
    const auto begin = jpeg->begin() + static_cast<std::ptrdiff_t>(at);
    const auto end = scan ? jpeg->end() : begin + static_cast<std::ptrdiff_t>(size);
    if ((*jpeg)[at + 1] != 0xc4) without.insert(without.end(), begin, end);
    at += scan ? jpeg->size() : size;
  }
  ASSERT_LT(without.size(), jpeg->size());
  const RawLayout layout{PixelFormat::Mjpg, kWidth, kHeight, 0};
  const auto whole = to_grey(*jpeg, layout);
  const auto same = to_grey(without, layout);
  ASSERT_TRUE(whole && same);
  EXPECT_EQ(*whole, *same);
  EXPECT_FALSE(to_grey(std::span(without).first(without.size() / 2), layout));
  EXPECT_FALSE(to_grey(without, {PixelFormat::Mjpg, kWidth, kHeight / 2, 0}));
}

}  // namespace
}  // namespace waymark
