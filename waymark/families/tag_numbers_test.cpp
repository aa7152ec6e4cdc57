#include "waymark/families/tag_numbers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(TagNumbers, AreSingleOnesAndRangesInTheOrderWritten) {
  EXPECT_THAT(parse_tag_numbers(FamilyId::Tag36h11, "0-3,7,9").value(), ElementsAre(0, 1, 2, 3, 7, 9));
  EXPECT_THAT(parse_tag_numbers(FamilyId::Tag36h11, "9, 2-2 ,0").value(), ElementsAre(9, 2, 0));
  EXPECT_THAT(parse_tag_numbers(FamilyId::Tag16h5, "29").value(), ElementsAre(29));
  EXPECT_EQ(parse_tag_numbers(FamilyId::TagCircle49h12, "0-65534").value().size(), 65535U);
}

TEST(TagNumbers, OutsideTheFamilyAreRefusedWithItsRange) {
  for (const char* text : {"30", "0-30", "28-40", "99999999999999999999", "0-99999999999999999999"}) {
    const auto numbers = parse_tag_numbers(FamilyId::Tag16h5, text);
    ASSERT_FALSE(numbers) << text;
    EXPECT_THAT(to_string(numbers.error()), HasSubstr("tag16h5 has the numbers 0 to 29.")) << text;
  }
}

TEST(TagNumbers, WhatIsNoListIsRefusedWithAnExample) {
  for (const char* text : {"", ",", "1,", ",1", "a", "1-", "-1", "-", "1--2", "1-2-3", "+1", "1.5", "0x1",
                           "1 2", "1;2", "all"}) {
    const auto numbers = parse_tag_numbers(FamilyId::Tag36h11, text);
    ASSERT_FALSE(numbers) << text;
    EXPECT_EQ(numbers.error().hint, "Write them as in 0-3,7,9.") << text;
  }
  EXPECT_EQ(to_string(parse_tag_numbers(FamilyId::Tag36h11, "7-3").error()),
            "(ids): the range 7-3 runs backwards. Write 3-7.");
}

TEST(TagNumbers, HostileListsEndEarly) {
  std::string text = "0-586";
  for (int i = 0; i < 10000; ++i) text += ",0-586";
  EXPECT_EQ(parse_tag_numbers(FamilyId::Tag36h11, text).error().code, ErrorCode::LimitExceeded);
  EXPECT_LT(to_string(parse_tag_numbers(FamilyId::Tag36h11, std::string(100000, 'x')).error()).size(), 200U);
}

}  // namespace
}  // namespace waymark
