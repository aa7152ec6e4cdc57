#include "waymark/app/common/job_control.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(Stopwatch, MeasuresTimeAndPeakMemory) {
  const Stopwatch watch;
  const double first = watch.seconds();
  EXPECT_GE(first, 0);
  EXPECT_GE(watch.seconds(), first);
  EXPECT_LT(first, 10);
  EXPECT_GT(peak_rss_mib(), 1);
}

}  // namespace
}  // namespace waymark
