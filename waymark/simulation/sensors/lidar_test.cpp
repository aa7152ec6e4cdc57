#include "waymark/simulation/sensors/lidar.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace waymark {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

LidarOptions exact() {
  return {.rate_hz = 10, .rays = 720, .range_min_m = 0.1, .range_max_m = 10, .noise_m = 0, .dropout = 0};
}

/// A 6 x 4 m room around the origin, measured between the faces of its walls.
World room() {
  World world;
  const Eigen::Vector2d corners[] = {{-3.05, -2.05}, {3.05, -2.05}, {3.05, 2.05}, {-3.05, 2.05}};
  for (int i = 0; i < 4; ++i) world.walls.push_back({.from_m = corners[i], .to_m = corners[(i + 1) % 4]});
  return world;
}

TEST(Lidar, RangesInARoomAreAnalytic) {
  const Lidar lidar(room(), exact());
  Random random(1);
  for (const SE2& pose : {SE2(), SE2(0.7, -1.1, 2.2)}) {
    const LaserScan scan =
        lidar.scan(pose, Eigen::Vector3d::Zero(), SensorTime(Duration(1'000'000'000)), random);
    ASSERT_EQ(scan.ranges_m.size(), 720U);
    EXPECT_EQ(scan.stamp, SensorTime(Duration(900'000'000))) << "time of the first ray";
    for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
      const double a = pose.yaw() + scan.angle_min_rad + static_cast<double>(i) * scan.angle_increment_rad;
      const double to_x = (std::copysign(3.0, std::cos(a)) - pose.x()) / std::cos(a);
      const double to_y = (std::copysign(2.0, std::sin(a)) - pose.y()) / std::sin(a);
      EXPECT_NEAR(scan.ranges_m[i], std::min(to_x, to_y), 1e-6) << i;
    }
  }
}

TEST(Lidar, RaysAccountForTheMotionDuringARevolution) {
  const Lidar lidar(room(), exact());
  Random random(1);
  // The robot drives straight ahead at 1 m/s. The first ray points backwards, 0.1 s before the end of the
  // revolution; the middle one points forwards, 0.05 s before the end.
  const LaserScan scan = lidar.scan(SE2(), {1, 0, 0}, SensorTime{}, random);
  EXPECT_NEAR(scan.ranges_m.front(), 3 - 0.1, 1e-6);
  EXPECT_NEAR(scan.ranges_m[360], 3 + 0.05, 1e-6);
}

TEST(Lidar, NoiseRangeAndDropoutsMatchTheOptions) {
  LidarOptions options = exact();
  options.noise_m = 0.02;
  options.dropout = 0.1;
  options.range_max_m = 2.5;
  const Lidar lidar(room(), options);
  Random random(1);
  int inside = 0;
  int received = 0;
  double squares = 0;
  for (int turn = 0; turn < 50; ++turn) {
    const LaserScan scan = lidar.scan(SE2(), Eigen::Vector3d::Zero(), SensorTime{}, random);
    for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
      const double truth =
          lidar.range_m({0, 0}, scan.angle_min_rad + static_cast<double>(i) * scan.angle_increment_rad);
      if (truth > 2.6) {
        EXPECT_EQ(scan.ranges_m[i], kInfinity);
      }
      if (truth > 2.4) continue;
      ++inside;
      if (std::isinf(scan.ranges_m[i])) continue;
      ++received;
      squares += std::pow(scan.ranges_m[i] - truth, 2);
    }
  }
  EXPECT_NEAR(static_cast<double>(received) / inside, 0.9, 4 * std::sqrt(0.09 / inside));
  EXPECT_NEAR(std::sqrt(squares / received) / 0.02, 1, 4 / std::sqrt(2.0 * received));
}

TEST(Lidar, SeesObjectsAtItsHeight) {
  World world;
  world.occluders.push_back({.centre_m = {2, 0, 0.05}, .size_m = {0.2, 0.2, 0.1}});
  world.panels.push_back({.map_T_panel = upright_tag({3, 0, 0.5}, std::numbers::pi),
                          .width_m = 0.5,
                          .height_m = 0.9,
                          .thickness_m = 0.02});
  LidarOptions options = exact();
  options.z_m = 0.15;
  EXPECT_NEAR(Lidar(world, options).range_m({0, 0}, 0), 3, 1e-9)
      << "over the low box, to the face of the board";
  options.z_m = 0.08;
  EXPECT_NEAR(Lidar(world, options).range_m({0, 0}, 0), 1.9, 1e-9);
  options.z_m = 1.2;
  EXPECT_EQ(Lidar(world, options).range_m({0, 0}, 0), kInfinity);
}

}  // namespace
}  // namespace waymark
