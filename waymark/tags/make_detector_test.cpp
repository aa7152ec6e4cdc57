#include "waymark/tags/make_detector.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(MakeDetector, IsChosenByItsName) {
  DetectorOptions options;
  EXPECT_EQ(options.detector, "waymark");
  EXPECT_TRUE(make_detector(options));
  options.quad_decimate = 2;
  const auto foreign = make_detector(options);
  ASSERT_FALSE(foreign);
  EXPECT_EQ(to_string(foreign.error()),
            "(quad_decimate): quad_decimate is an option of AprilTag 3. Leave it out, or use the detector "
            "apriltag3.");
  options.detector = "apriltag3";
  EXPECT_TRUE(make_detector(options));
  options = {.detector = "apriltag3", .find_inverted = true};
  EXPECT_EQ(make_detector(options).error().place.key, "find_inverted");
  options.detector = "aruco";
  EXPECT_EQ(make_detector(options).error().place.key, "detector");
}

}  // namespace
}  // namespace waymark
