#include "waymark/localization/timeline.hpp"

#include <chrono>
#include <optional>

#include <gtest/gtest.h>

namespace waymark {
namespace {

/// When wheels slip, they measure turns less accurately than distances; a gyro is not affected.
TEST(MotionInput, TurnsByWheelsHaveAdditionalNoise) {
  RiekfOptions options;
  options.motion.wheel_yaw_rad_sqrt_m = 0.1;
  for (const bool gyro : {false, true}) {
    MotionInput input(options);
    std::optional<MotionSegment> segment;
    for (int i = 0; i < 3; ++i) {
      const SensorTime stamp(std::chrono::milliseconds(100 * i));
      if (gyro) input.add(ImuSample{.stamp = stamp});
      segment = input.add(Odometry{.stamp = stamp, .odom_T_base = SE2(0.04 * i, 0, 0)});
    }
    ASSERT_TRUE(segment);
    EXPECT_NEAR(segment->step.extra_rad2, gyro ? 0 : 0.01 * 0.04, 1e-12);
  }
}

}  // namespace
}  // namespace waymark
