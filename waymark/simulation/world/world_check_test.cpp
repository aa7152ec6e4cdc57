// Tests the frame conventions with an orbiting camera, and the check of the line in a world.
#include "waymark/simulation/world/world_check.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace waymark {
namespace {

/// Four tags around the origin that face outwards, a wall with two more, and a round line in between.
World some_world() {
  World world{.name = "some"};
  for (int i = 0; i < 4; ++i) {
    const double angle = i * 1.5707963267948966;
    world.tags.tags[{FamilyId::Tag36h11, i}] = {
        .map_T_tag = upright_tag({2 * std::cos(angle), 2 * std::sin(angle), 0.3}, angle + 3.14159),
        .size_m = 0.16};
    world.path_m.emplace_back(std::cos(angle), std::sin(angle));
  }
  return world;
}

TEST(Orbit, WithoutNoiseAllLoopsClose) {
  const auto report = orbit(some_world(), {.sigma_m = 0, .sigma_deg = 0});
  ASSERT_TRUE(report);
  EXPECT_LT(report->closure, 1e-12);
  EXPECT_LT(report->jump_m, 1e-12);
  EXPECT_NEAR(report->smallest_axis_cosine, 1, 1e-12);
  EXPECT_TRUE(report->closes() && report->continuous() && report->upright());
  for (const SE3& map_T_cam : report->map_T_cam) {
    EXPECT_NEAR((map_T_cam.translation() - report->map_t_center).norm(), report->radius_m, 1e-12);
    const Eigen::Vector3d middle = map_T_cam.inverse() * report->map_t_center;
    EXPECT_TRUE(middle.isApprox(Eigen::Vector3d(0, 0, report->radius_m), 1e-12))
        << "in the centre of the image";
    EXPECT_GT(map_T_cam.rotation().matrix()(2, 1), -1 - 1e-12);
    EXPECT_NEAR((map_T_cam.rotation() * Eigen::Vector3d::UnitY()).z(), -1, 1e-12) << "y down";
  }
}

TEST(Orbit, SmallNoiseCausesNoJumpsOrInversions) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto report = orbit(some_world(), {.seed = seed});
    ASSERT_TRUE(report);
    EXPECT_TRUE(report->continuous()) << report->jump_m << " of " << report->jump_limit_m << " m, "
                                      << report->jump_deg << " of " << report->jump_limit_deg << " deg";
    EXPECT_GT(report->smallest_axis_cosine, 0.99);
    EXPECT_GT(report->jump_m, 0.005) << "the noise has an effect";
    EXPECT_GT(report->jump_m, report->jump_limit_m / 12) << "the limit is not too wide";
  }
}

TEST(Orbit, AnInversionIsDetected) {
  const auto report = orbit(some_world(), {.sigma_deg = 90});
  ASSERT_TRUE(report);
  EXPECT_FALSE(report->upright());
}

TEST(Orbit, InvalidInputIsRejected) {
  EXPECT_FALSE(orbit(World{.name = "empty"}));
  EXPECT_FALSE(orbit(some_world(), {.steps = 0}));
  EXPECT_FALSE(orbit(some_world(), {.sigma_m = std::nan("")}));
}

TEST(WorldCheck, ReportsVisibilityAndClearance) {
  const RobotModel robot{
      .hull = {.front_m = 0.1, .rear_m = 0.1, .width_m = 0.2, .height_m = 0.5},
      .base_T_cam =
          SE3(SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished()), {0, 0, 0.3})};
  const auto camera = CameraModel::make(PinholeRadtan{.fx = 400, .fy = 400, .cx = 320, .cy = 240}, 640, 480);
  const World world = some_world();
  const auto check = check_world(world, robot, *camera);
  ASSERT_TRUE(check);
  EXPECT_NEAR(check->lap_m, 6.28, 0.5);
  // The line passes (1, 0) in the +y direction; the hull extends 0.1 m to its side and the tag is at x = 2.
  EXPECT_NEAR(check->min_clearance_m, 0.9, 0.02);
  EXPECT_GT(check->sharpest_left_1_m, 0.5);
  EXPECT_LT(check->sharpest_right_1_m, 0.1);
  EXPECT_LT(check->two_tags_fraction, 0.5) << "four tags are too few";
  EXPECT_EQ(check_world(world, robot, *camera, {.max_range_m = 0.1})->fewest_tags, 0U);
  EXPECT_FALSE(check_world(World{.name = "no line"}, robot, *camera));
}

}  // namespace
}  // namespace waymark
