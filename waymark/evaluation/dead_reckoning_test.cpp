#include "waymark/evaluation/dead_reckoning.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

SensorTime at_s(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

TEST(DeadReckoning, UsesTheRotationOfTheGyroAndTheDistanceOfTheWheels) {
  std::vector<Odometry> odometry;
  std::vector<ImuSample> imu;
  for (int i = 0; i <= 500; ++i) {  // the wheels measure half the turn
    const double t_s = 0.02 * i;
    imu.push_back({.stamp = at_s(t_s), .angular_velocity_rad_s = {0, 0, 0.4}});
    odometry.push_back({.stamp = at_s(t_s), .odom_T_base = SE2::exp({0.5 * t_s, 0, 0.2 * t_s})});
  }
  const Trajectory reckoned = gyro_odometry(odometry, imu);
  ASSERT_EQ(reckoned.size(), odometry.size());
  const SE2 end = project_to_plane(reckoned.back().map_T_base);
  const SE2 truth = SE2::exp({5, 0, 4});
  EXPECT_LT((end.inverse() * truth).log().norm(), 1e-3);
  const EstimatedTrajectory placed = placed_at(reckoned, {at_s(1), lift(SE2(7, 8, 9))});
  EXPECT_EQ(placed.front().stamp, at_s(1));
  EXPECT_LT((placed.front().map_T_base.translation() - Eigen::Vector3d(7, 8, 0)).norm(), 1e-9);
  EXPECT_TRUE(gyro_odometry(odometry, {}).empty());
  EXPECT_TRUE(placed_at(reckoned, {at_s(99), SE3()}).empty());
}

}  // namespace
}  // namespace waymark
