#include "waymark/samples/tag_sizes.hpp"

#include <limits>

#include <gmock/gmock.h>

namespace waymark {
namespace {

using ::testing::HasSubstr;

constexpr TagId kSmall{FamilyId::Tag36h11, 3};
constexpr TagId kOther{FamilyId::Tag36h11, 4};

TEST(TagSizes, OwnSizeOverridesTheDefault) {
  const TagSizes sizes{.default_size_m = 0.16, .size_by_tag_m = {{kSmall, 0.05}}};
  EXPECT_EQ(sizes.size_m(kSmall).value(), 0.05);
  EXPECT_EQ(sizes.size_m(kOther).value(), 0.16);
  EXPECT_EQ(sizes.size_m({FamilyId::Tag16h5, 3}).value(), 0.16) << "an id consists of a family and a number";
  EXPECT_TRUE(sizes.check());
}

TEST(TagSizes, TheErrorNamesTheUnknownTag) {
  const TagSizes sizes{.size_by_tag_m = {{kSmall, 0.05}}};
  const Result<double> size = sizes.size_m(kOther);
  ASSERT_FALSE(size);
  EXPECT_EQ(size.error().code, ErrorCode::NotFound);
  EXPECT_EQ(size.error().place.key, "tag36h11:4");
}

TEST(TagSizes, UnusualSizesGiveAWarning) {
  EXPECT_TRUE(TagSizes{.default_size_m = 0.16}.warnings().empty());
  const TagSizes unusual{.default_size_m = 1.6, .size_by_tag_m = {{kSmall, 0.004}, {kOther, 0.005}}};
  const auto warnings = unusual.warnings();
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_THAT(warnings[0], HasSubstr("1.6 m"));
  EXPECT_THAT(warnings[1], HasSubstr("tag36h11:3"));
}

TEST(TagSizes, SizesOfPrintedTagsHaveLimits) {
  for (const double valid : {kMinTagSize_m, 0.16, kMaxTagSize_m})
    EXPECT_TRUE(check_printed_size(valid, "tag_size_m"));
  for (const double invalid : {0.0, -0.1, 0.0001651, 16.0, std::numeric_limits<double>::quiet_NaN()}) {
    const Status status = check_printed_size(invalid, "tag_size_m");
    ASSERT_FALSE(status) << invalid;
    EXPECT_EQ(status.error().place.key, "tag_size_m");
  }
}

TEST(TagSizes, ASizeInAnotherUnitIsConvertedInTheHint) {
  EXPECT_THAT(check_printed_size(16, {}).error().hint, HasSubstr("16 cm are 0.16 m"));
  EXPECT_THAT(check_printed_size(165.1, {}).error().hint, HasSubstr("165.1 mm are 0.1651 m"));
  for (const double other : {0.0, -16.0, 1e9, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_TRUE(size_in_metres(other).empty()) << other;
}

TEST(TagSizes, InvalidSizesAreErrors) {
  const double bad_sizes[] = {0.0, -0.1, std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity()};
  for (const double bad : bad_sizes) {
    const TagSizes by_default{.default_size_m = bad};
    EXPECT_FALSE(by_default.check());
    EXPECT_FALSE(by_default.size_m(kOther));
    const TagSizes by_tag{.default_size_m = 0.16, .size_by_tag_m = {{kSmall, bad}}};
    ASSERT_FALSE(by_tag.check());
    EXPECT_EQ(by_tag.check().error().place.key, "tag36h11:3");
    EXPECT_FALSE(by_tag.size_m(kSmall));
    EXPECT_TRUE(by_tag.size_m(kOther));
  }
}

}  // namespace
}  // namespace waymark
