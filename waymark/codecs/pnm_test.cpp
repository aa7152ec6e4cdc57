#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/codecs/image_codec.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using namespace std::string_view_literals;

Result<Image> decode(std::string_view text) {
  return decode_image(std::vector<std::uint8_t>(text.begin(), text.end()), "in.pgm");
}

std::vector<int> first_row(const Result<Image>& image) {
  std::vector<int> row;
  if (!image) {
    ADD_FAILURE() << to_string(image.error());
    return row;
  }
  for (int x = 0; x < image->width(); ++x) row.push_back(image->row(0)[x]);
  return row;
}

TEST(Pnm, ReadsTextAndRawGreyAndColour) {
  EXPECT_EQ(first_row(decode("P2\n3 1\n255\n0 128 255\n")), (std::vector{0, 128, 255}));
  EXPECT_EQ(first_row(decode("P3 2 1 255 255 0 0 10 20 30")), (std::vector{76, 18}));
  EXPECT_EQ(first_row(decode("P5\n3 1\n255\n\x00\x80\xff"sv)), (std::vector{0, 128, 255}));
  EXPECT_EQ(first_row(decode("P6\n2 1\n255\n\xff\x00\x00\x0a\x14\x1e"sv)), (std::vector{76, 18}));
}

TEST(Pnm, ScalesAnyMaximumToTheNearestByte) {
  EXPECT_EQ(first_row(decode("P2 3 1 1 0 1 1")), (std::vector{0, 255, 255}));
  EXPECT_EQ(first_row(decode("P2 3 1 1000 0 500 1000")), (std::vector{0, 128, 255}));  // 127.5 rounds up
  EXPECT_EQ(first_row(decode("P5 3 1 65535\n\x00\x80\x80\x80\xff\xff"sv)), (std::vector{0, 128, 255}));
  EXPECT_EQ(first_row(decode("P6 1 1 65535\n\xff\xff\x00\x00\x00\x00"sv)), (std::vector{76}));
}

TEST(Pnm, SkipsCommentsInTheHeader) {
  EXPECT_EQ(first_row(decode("P2 # a comment\n# another\n2 1 # size\n255\n# samples\n7 9\n")),
            (std::vector{7, 9}));
  EXPECT_EQ(first_row(decode("P5\n#c\n2 1\n255\n79"sv)), (std::vector{int{'7'}, int{'9'}}));
}

TEST(Pnm, ReadsTheFirstOfSeveralImages) {
  EXPECT_EQ(first_row(decode("P5 1 1 255\nAP5 1 1 255\nB"sv)), (std::vector{int{'A'}}));
}

TEST(Pnm, ErrorsHaveTheByte) {
  const auto expect_error = [](std::string_view text, std::optional<std::int64_t> byte, const char* value) {
    const Result<Image> image = decode(text);
    ASSERT_FALSE(image) << text;
    if (byte) EXPECT_EQ(image.error().place.byte, byte) << text;
    EXPECT_THAT(image.error().message, HasSubstr(value));
    testing::expect_on_page("files", image.error());
  };
  expect_error("P5 x 1 255\n", 3, "width");
  expect_error("P5 -1 1 255\n", 3, "width");
  expect_error("P5 0 1 255\n", {}, "0 x 1 px");
  expect_error("P5 1 1 0\n ", {}, "maximum 0");
  expect_error("P5 1 1 65536\n ", {}, "65535");
  expect_error("P5 1 1 255x ", 10, "header");
  expect_error("P2 2 1 7 3 8", 11, "7");
  expect_error("P2 2 1 7 3 z", 11, "sample");
  expect_error("P5 2 1 7\n\x03\x08"sv, 10, "8");
}

TEST(Pnm, TruncationAnywhereIsAnError) {
  for (const std::string_view whole : {"P2 2 2 255 1 2 3 4"sv, "P3 1 2 9 1 2 3 4 5 6"sv,
                                       "P5\n2 2\n255\nabcd"sv, "P6\n1 1\n1000\n\x01\x02\x01\x02\x01\x02"sv}) {
    ASSERT_TRUE(decode(whole));
    for (std::size_t length = 0; length < whole.size(); ++length) {
      const Result<Image> image = decode(whole.substr(0, length));
      ASSERT_FALSE(image) << whole.substr(0, length);
      EXPECT_EQ(image.error().code, ErrorCode::Unreadable);
    }
  }
}

TEST(Pnm, AHugeClaimedSizeIsRejectedBeforeAllocation) {
  EXPECT_EQ(decode("P5 2147483647 2147483647 255\nx").error().code, ErrorCode::Unreadable);
  EXPECT_EQ(decode("P6 2147483647 2147483647 65535\nx").error().code, ErrorCode::Unreadable);
  EXPECT_EQ(decode("P2 2147483647 2147483647 255 1").error().code, ErrorCode::Unreadable);
  EXPECT_EQ(decode("P5 99999999999999999999 1 255\nx").error().code, ErrorCode::Unreadable);
  EXPECT_EQ(decode("P5 20000 20000 255\nx").error().code, ErrorCode::Unreadable);
}

}  // namespace
}  // namespace waymark
