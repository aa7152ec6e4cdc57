#include "waymark/replay/lidar_zone.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(LidarZone, SeesWhatIsInTheWayOfACurve) {
  const Hull hull{.front_m = 0.16, .rear_m = 0.16, .width_m = 0.22, .height_m = 0.25};
  LaserScan scan{
      .angle_min_rad = -kPi, .angle_increment_rad = kPi / 180, .range_min_m = 0.1, .range_max_m = 8};
  scan.ranges_m.assign(360, std::numeric_limits<float>::infinity());
  scan.ranges_m[180] = 1.0F;  // straight ahead
  EXPECT_NEAR(free_way_m(scan, SE2(), hull, 0, false), 0.84, 1e-6);
  EXPECT_TRUE(std::isinf(free_way_m(scan, SE2(), hull, 1.5, false))) << "the curve leads past it";
  EXPECT_TRUE(std::isinf(free_way_m(scan, SE2(), hull, 0, true))) << "it is not behind";
  scan.ranges_m[0] = 0.5F;  // behind
  EXPECT_NEAR(free_way_m(scan, SE2(), hull, 0, true), 0.34, 1e-6);
  scan.ranges_m.assign(360, std::nanf(""));
  EXPECT_TRUE(std::isinf(free_way_m(scan, SE2(), hull, 0, false)));
}

}  // namespace
}  // namespace waymark
