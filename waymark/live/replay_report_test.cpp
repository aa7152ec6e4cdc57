#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/live/replay_route.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(ReplayReport, ARobotThatSwayedBackwardsHasNoNegativeZero) {
  ReplayReport report{.route_length_m = 17.4};
  report.end.driven_m = -0.001;
  report.end.state = ReplayState::Stopped;
  report.end.reason = "a tag is near";
  EXPECT_THAT(ending(report), HasSubstr("0.00 m along a route of 17.40 m"));
  report.end.driven_m = -0.01;
  EXPECT_THAT(ending(report), HasSubstr("stopped -0.01 m along"));
  EXPECT_THAT(to_text(report), Not(HasSubstr("-0.00")));
}

}  // namespace
}  // namespace waymark
