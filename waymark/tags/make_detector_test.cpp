#include "waymark/tags/make_detector.hpp"

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

TEST(MakeDetector, IsSelectedByName) {
  DetectorOptions options;
  EXPECT_EQ(options.detector, "waymark");
  EXPECT_TRUE(make_detector(options));
  options.quad_decimate = 2;
  const auto foreign = make_detector(options);
  ASSERT_FALSE(foreign);
  EXPECT_EQ(foreign.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(foreign.error().place.key, "quad_decimate");
  testing::expect_on_page("detect", foreign.error());
  options.detector = "apriltag3";
  EXPECT_TRUE(make_detector(options));
  options = {.detector = "apriltag3", .find_inverted = true};
  EXPECT_EQ(make_detector(options).error().place.key, "find_inverted");
  testing::expect_on_page("detect", make_detector(options).error());
  options.detector = "aruco";
  EXPECT_EQ(make_detector(options).error().place.key, "detector");
  testing::expect_on_page("detect", make_detector(options).error());
}

}  // namespace
}  // namespace waymark
