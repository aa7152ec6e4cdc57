// Tests that a reset of the odometry is distinguished from a drive.
#include "waymark/samples/odometry_jump.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

Odometry at(double time_s, const SE2& odom_T_base, double speed_m_s) {
  return {.stamp = SensorTime(Duration(static_cast<std::int64_t>(time_s * 1e9))),
          .odom_T_base = odom_T_base,
          .speed_m_s = speed_m_s};
}

TEST(OdometryJump, ARestartAfterALongGapIsExactlyAtTheOrigin) {
  const Odometry before = at(4.4, SE2(1.09, 0.49, 1.5), 0.33);
  EXPECT_TRUE(odometry_jumped(before, at(6.5, SE2(), 0))) << "reachable in two seconds, but too exactly";
  EXPECT_FALSE(odometry_jumped(before, at(6.5, SE2(0.01, 0.004, 0.02), 0.3))) << "drives past the origin";
  EXPECT_FALSE(odometry_jumped(at(1, SE2(0.006, 0, 0), 0.1), at(1.05, SE2(), 0))) << "stops at the origin";
}

TEST(OdometryJump, SamplesOutOfOrderAreNotJumps) {
  EXPECT_FALSE(odometry_jumped(at(2, SE2(3, 0, 0), 0), at(2, SE2(), 0)));
}

}  // namespace
}  // namespace waymark
