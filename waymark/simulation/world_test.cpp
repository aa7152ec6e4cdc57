#include "waymark/simulation/world.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(World, ALeaningTagTurnsItsFaceUp) {
  const SE3 upright = leaning_tag({1, 2, 0.5}, 0.3, 0);
  EXPECT_TRUE(upright.rotation().matrix().isApprox(upright_tag({1, 2, 0.5}, 0.3).rotation().matrix(), 1e-15));
  const SE3 lying = leaning_tag({1, 2, 0}, 0.3, kPi / 2);
  EXPECT_TRUE((lying.rotation() * Eigen::Vector3d::UnitZ()).isApprox(-Eigen::Vector3d::UnitZ(), 1e-12));
  // Its upper edge has fallen away from the reader.
  EXPECT_LT(
      (lying.rotation() * -Eigen::Vector3d::UnitY()).dot(Eigen::Vector3d(std::cos(0.3), std::sin(0.3), 0)),
      -0.999);
}

TEST(World, RaysMeetWallsWhereTheyStand) {
  const Occluder wall = as_box({.from_m = {2, -1}, .to_m = {2, 3}, .height_m = 1, .thickness_m = 0.2});
  const Eigen::Vector3d eye(0, 0, 0.5);
  EXPECT_NEAR(ray_length(wall, eye, {1, 0, 0}), 1.9, 1e-12);
  EXPECT_NEAR(ray_length(wall, eye, {1, 1, 0}), 1.9, 1e-12) << "in lengths of the direction";
  EXPECT_EQ(ray_length(wall, eye, {-1, 0, 0}), std::numeric_limits<double>::infinity());
  EXPECT_EQ(ray_length(wall, {0, 0, 1.5}, {1, 0, 0}), std::numeric_limits<double>::infinity()) << "above it";
  EXPECT_EQ(ray_length(wall, {2, 0, 0.5}, {1, 0, 0}), 0) << "from inside";
}

TEST(World, AWallHidesWhatIsBehindAndShowsWhatHangsOnIt) {
  World world;
  world.walls.push_back({.from_m = {2, -1}, .to_m = {2, 3}, .height_m = 1, .thickness_m = 0.1});
  const Eigen::Vector3d eye(0, 0, 0.5);
  EXPECT_FALSE(line_of_sight(world, eye, {3, 0, 0.5}));
  EXPECT_TRUE(line_of_sight(world, eye, {1.95, 0, 0.5})) << "on its face";
  EXPECT_TRUE(line_of_sight(world, eye, {3, 0, 5})) << "over it";
  EXPECT_TRUE(line_of_sight(world, eye, {3, -2, 0.5})) << "beside it";
}

}  // namespace
}  // namespace waymark
