#include "waymark/app/tags/tag_prints.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(BoardStyle, IsOneOfTagsOrOfSquares) {
  for (const char* style : {"aprilgrid", "separate", "chessboard", "charuco"})
    EXPECT_TRUE(check_board_style(style));
  EXPECT_THAT(to_string(check_board_style("chesboard").error()),
              StartsWith("(style): unknown board style 'chesboard'. Did you mean 'chessboard'?"));
}

TEST(PlannedBoardOfTags, HoldsWhatKalibrReadsOnlyWhereItIsAskedFor) {
  plot::BoardOptions options{.tag_size_m = 0.024};
  EXPECT_EQ(plan_board(options, false)->kalibr_target, "");
  EXPECT_THAT(plan_board(options, true)->kalibr_target, HasSubstr("aprilgrid"));
  options.style = plot::BoardStyle::Separate;
  ASSERT_TRUE(plan_board(options, false));
  EXPECT_THAT(to_string(plan_board(options, true).error()), StartsWith("(--kalibr-yaml): "));
  options.tag_size_m = 4;
  EXPECT_THAT(to_string(plan_board(options, false).error()), HasSubstr("fit"));
}

}  // namespace
}  // namespace waymark
