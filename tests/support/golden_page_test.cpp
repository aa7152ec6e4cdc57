// Golden pages mask numbers and temporary paths, but not words and names.
#include "tests/support/golden_page.hpp"

#include <gtest/gtest.h>

namespace waymark::testing {
namespace {

TEST(GoldenPage, NumbersAreMaskedAndNamesStay) {
  EXPECT_EQ(masked("tag36h11:5 is 0.25 m away, at -3.5e-6 (2 of 12)"),
            "tag36h11:# is # m away, at # (# of #)");
  EXPECT_EQ(masked("16:9, x=1,y=-2; 1280x720; v4l2, mp4"), "#:#, x=#,y=#; 1280x720; v4l2, mp4");
  EXPECT_EQ(masked("12 tags, 3 %"), "# tags, # %");
}

TEST(GoldenPage, TemporaryFoldersAreMasked) {
  EXPECT_EQ(masked("/tmp/waymark-Map.Fails-m/map.yaml: no tags"), "FOLDER/map.yaml: no tags");
}

TEST(GoldenPage, ATextIsComparedWithItsEntry) {
  expect_on_page("test_support", "the first text of 3 lines\nwith numbers: 0.5");
  expect_on_page(
      "test_support",
      Error{ErrorCode::Unreadable, "duplicate column 'x_m'", {.source = "a.csv", .line = 3}, "Rename one."});
}

}  // namespace
}  // namespace waymark::testing
