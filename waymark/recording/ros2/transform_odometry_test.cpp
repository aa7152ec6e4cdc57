#include "waymark/recording/ros2/transform_odometry.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/samples/odometry_jump.hpp"

namespace waymark::ros2 {
namespace {

SensorTime at_ms(int ms) { return SensorTime(std::chrono::milliseconds(ms)); }

TransformStamped base_at(int ms, const SE2& odom_T_base, const char* parent = "odom",
                         const char* child = "base_link") {
  return to_ros_transform(at_ms(ms), parent, child, lift(odom_T_base));
}

TEST(TransformOdometry, FramesAreRecognisedInAnyNamespace) {
  for (const char* frame : {"odom", "/odom", "r1/odom", "/r1/odom"}) EXPECT_TRUE(is_odometry_frame(frame));
  for (const char* frame : {"map", "visual_odom", "odom_combined", "", "r1"})
    EXPECT_FALSE(is_odometry_frame(frame)) << frame;
  for (const char* frame : {"base_link", "/base_footprint", "r1/base_link"})
    EXPECT_TRUE(is_usual_base(frame));
  for (const char* frame : {"base", "camera_base_link", "laser"}) EXPECT_FALSE(is_usual_base(frame)) << frame;
}

TEST(TransformOdometry, VelocitiesAreMeansOfTheIntervalBefore) {
  TransformOdometry odometry(std::nullopt);
  const SE2 start(1, 2, 0.5);
  const auto first = odometry.add("/tf", base_at(100, start));
  ASSERT_TRUE(first && *first);
  EXPECT_EQ((*first)->stamp, at_ms(100));
  EXPECT_NEAR((*first)->odom_T_base.yaw(), 0.5, 1e-12);
  EXPECT_EQ((*first)->speed_m_s, 0);
  const auto second = odometry.add("/tf", base_at(150, start * SE2(0.02, 0, 0.01)));
  ASSERT_TRUE(second && *second);
  EXPECT_NEAR((*second)->speed_m_s, 0.4, 1e-9);
  EXPECT_NEAR((*second)->yaw_rate_rad_s, 0.2, 1e-9);
  const auto jumped = odometry.add("/tf", base_at(200, SE2()));
  ASSERT_TRUE(jumped && *jumped);
  EXPECT_EQ((*jumped)->speed_m_s, 0) << "a reset is not a motion";
}

TEST(TransformOdometry, AResetNearTheOriginHasNoVelocityEither) {
  TransformOdometry odometry(std::nullopt);
  for (int i = 0; i <= 5; ++i) ASSERT_TRUE(odometry.add("/tf", base_at(50 * i, SE2(0.05 * i, 0, 0))));
  const auto before = odometry.add("/tf", base_at(300, SE2(0.25, 0, 0)));
  const auto reset = odometry.add("/tf", base_at(350, SE2()));
  ASSERT_TRUE(before && *before && reset && *reset);
  EXPECT_EQ((*reset)->speed_m_s, 0);
  EXPECT_TRUE(odometry_jumped(**before, **reset));
}

TEST(TransformOdometry, OtherLinksAndRepeatedStampsAreSkipped) {
  TransformOdometry odometry(std::nullopt);
  EXPECT_FALSE(*odometry.add("/tf", base_at(1, {}, "map", "odom")));
  EXPECT_FALSE(*odometry.add("/tf", base_at(1, {}, "odom", "lift")));
  EXPECT_TRUE(*odometry.add("/tf", base_at(1, {}, "r1/odom", "r1/base_link")));
  EXPECT_FALSE(*odometry.add("/tf", base_at(1, {}, "/r1/odom", "/r1/base_link"))) << "the same stamp";
  EXPECT_FALSE(*odometry.add("/tf", base_at(2, {}, "r2/odom", "r2/base_link"))) << "another robot";
  EXPECT_TRUE(*odometry.add("/tf", base_at(2, {}, "r1/odom", "r1/base_link")));
  EXPECT_FALSE(*odometry.add("/tf", base_at(3, {}, "odom", "r1/base_link"))) << "another parent";
  EXPECT_FALSE(*odometry.add("/r2/tf", base_at(3, {}, "r1/odom", "r1/base_link"))) << "another topic";
  TransformOdometry none(OdometryFrames{});
  EXPECT_FALSE(*none.add("/tf", base_at(1, {})));
  TransformOdometry chosen(OdometryFrames{"/tf", "odom", "lift"});
  EXPECT_FALSE(*chosen.add("/tf", base_at(1, {}, "odom", "base_link")));
  EXPECT_TRUE(*chosen.add("/tf", base_at(1, {}, "odom", "lift")));
}

TEST(TransformOdometry, InvalidNumbersAreErrors) {
  TransformOdometry odometry(std::nullopt);
  TransformStamped transform = base_at(1, {});
  transform.translation.x = std::numeric_limits<double>::quiet_NaN();
  const auto result = odometry.add("/tf", transform);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::Unreadable);
}

}  // namespace
}  // namespace waymark::ros2
