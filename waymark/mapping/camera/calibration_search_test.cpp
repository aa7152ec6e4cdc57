#include "waymark/mapping/camera/calibration_search.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(CalibrationSearch, RootMeanOfAnEmptyListIsZero) {
  EXPECT_EQ(internal::root_mean({}), 0);
  EXPECT_EQ(internal::root_mean({9, 16, 0, 0}), 2.5);
}

}  // namespace
}  // namespace waymark
