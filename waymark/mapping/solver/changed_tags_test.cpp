// Two prints cannot overlap.
#include "waymark/mapping/solver/changed_tags.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

constexpr double kSide_m = 0.16;

SE3 moved_by(double x_m, double turn_rad = 0) { return {SO3::exp({0, turn_rad, 0}), {x_m, 0, 0}}; }

TEST(ChangedTags, PrintsOverlapWithinHalfASideIfTheyFaceTheSameWay) {
  EXPECT_TRUE(would_overlap(SE3(), moved_by(0.07), kSide_m));
  EXPECT_TRUE(would_overlap(SE3(), moved_by(0.0, 1.0), kSide_m)) << "a mirrored pose";
  EXPECT_FALSE(would_overlap(SE3(), moved_by(0.09), kSide_m));
  EXPECT_FALSE(would_overlap(SE3(), moved_by(0.004, 3.1), kSide_m)) << "the two faces of a board";
  EXPECT_FALSE(would_overlap(SE3(), moved_by(0.07), 0.1)) << "smaller prints";
}

TEST(ChangedTags, AMisreadIdHasFewObservationsAtThePlaceOfAnotherTag) {
  EXPECT_TRUE(is_misread({SE3(), 5}, {moved_by(0.02), 100}, kSide_m));
  EXPECT_FALSE(is_misread({SE3(), 50}, {moved_by(0.02), 100}, kSide_m)) << "one may have replaced the other";
  EXPECT_FALSE(is_misread({SE3(), 5}, {moved_by(0.2), 100}, kSide_m));
}

}  // namespace
}  // namespace waymark
