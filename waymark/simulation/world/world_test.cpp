#include "waymark/simulation/world/world.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/simulation/sensors/tag_camera.hpp"

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(UprightTag, FacesItsViewer) {
  const SE3 map_T_tag = upright_tag({1, 2, 0.3}, std::numbers::pi / 2);
  EXPECT_TRUE((map_T_tag.rotation() * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d(0, -1, 0), 1e-12))
      << "z points into the tag";
  EXPECT_TRUE((map_T_tag.rotation() * Eigen::Vector3d::UnitY()).isApprox(Eigen::Vector3d(0, 0, -1), 1e-12))
      << "y down";
  EXPECT_TRUE((map_T_tag.rotation() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d(-1, 0, 0), 1e-12))
      << "x right";
}

TEST(World, ATagTiltedBackwardsFacesUp) {
  const SE3 upright = leaning_tag({1, 2, 0.5}, 0.3, 0);
  EXPECT_TRUE(upright.rotation().matrix().isApprox(upright_tag({1, 2, 0.5}, 0.3).rotation().matrix(), 1e-15));
  const SE3 lying = leaning_tag({1, 2, 0}, 0.3, kPi / 2);
  EXPECT_TRUE((lying.rotation() * Eigen::Vector3d::UnitZ()).isApprox(-Eigen::Vector3d::UnitZ(), 1e-12));
  // Its upper edge has moved away from the viewer.
  EXPECT_LT(
      (lying.rotation() * -Eigen::Vector3d::UnitY()).dot(Eigen::Vector3d(std::cos(0.3), std::sin(0.3), 0)),
      -0.999);
}

TEST(World, RaysIntersectWallsAtTheirFaces) {
  const Occluder wall = as_box({.from_m = {2, -1}, .to_m = {2, 3}, .height_m = 1, .thickness_m = 0.2});
  const Eigen::Vector3d eye(0, 0, 0.5);
  EXPECT_NEAR(ray_length(wall, eye, {1, 0, 0}), 1.9, 1e-12);
  EXPECT_NEAR(ray_length(wall, eye, {1, 1, 0}), 1.9, 1e-12) << "as a multiple of the direction";
  EXPECT_EQ(ray_length(wall, eye, {-1, 0, 0}), std::numeric_limits<double>::infinity());
  EXPECT_EQ(ray_length(wall, {0, 0, 1.5}, {1, 0, 0}), std::numeric_limits<double>::infinity())
      << "above the box";
  EXPECT_EQ(ray_length(wall, {2, 0, 0.5}, {1, 0, 0}), 0) << "from inside the box";
}

TEST(World, AWallHidesTagsBehindItButNotTagsOnIt) {
  World world;
  world.walls.push_back({.from_m = {2, -1}, .to_m = {2, 3}, .height_m = 1, .thickness_m = 0.1});
  const Eigen::Vector3d eye(0, 0, 0.5);
  EXPECT_FALSE(line_of_sight(world, eye, {3, 0, 0.5}));
  EXPECT_TRUE(line_of_sight(world, eye, {1.95, 0, 0.5})) << "on the face";
  EXPECT_TRUE(line_of_sight(world, eye, {3, 0, 5})) << "over the box";
  EXPECT_TRUE(line_of_sight(world, eye, {3, -2, 0.5})) << "past the side of the box";
}

TEST(World, ABoardHasItsTagOnBothSides) {
  World world;
  const TagId id{FamilyId::Tag36h11, 3};
  const MappedTag front{.map_T_tag = upright_tag({2, 0, 0.5}, kPi), .size_m = 0.24};
  world.tags.tags[id] = front;
  EXPECT_EQ(readable_tags(world).size(), 1U);
  world.tag_board_m = 0.02;
  const auto tags = readable_tags(world);
  ASSERT_EQ(tags.size(), 2U);
  EXPECT_EQ(tags[1].tag, id);
  const SE3& back = tags[1].placed.map_T_tag;
  EXPECT_TRUE(back.translation().isApprox(Eigen::Vector3d(2.02, 0, 0.5), 1e-12));
  EXPECT_TRUE(back.rotation().matrix().isApprox(upright_tag({0, 0, 0}, 0).rotation().matrix(), 1e-12))
      << "upright, facing a viewer on the other side";
}

TEST(World, ACameraSeesTheBackOnlyOfBoards) {
  World world;
  world.tags.tags[{FamilyId::Tag36h11, 3}] = {.map_T_tag = upright_tag({0, 0, 0.5}, 0), .size_m = 0.24};
  const auto camera = CameraModel::make(PinholeRadtan{.fx = 500, .fy = 500, .cx = 320, .cy = 240}, 640, 480);
  ASSERT_TRUE(camera);
  const SE3 map_T_cam(SO3::from_rpy(-kPi / 2, 0, -kPi / 2), {-2, 0, 0.5});  // behind it, looking along map x
  for (const double board_m : {0.0, 0.02}) {
    world.tag_board_m = board_m;
    Random random(1);
    const TagFrame frame = see_tags(world, *camera, map_T_cam, SensorTime{}, {.miss_probability = 0}, random);
    EXPECT_EQ(frame.detections.size(), board_m > 0 ? 1U : 0U);
    if (frame.detections.empty()) continue;
    // Its left side is on the left for a viewer on that side.
    EXPECT_LT(frame.detections[0].corners_px[0].x(), frame.detections[0].corners_px[1].x());
    EXPECT_NEAR(frame.detections[0].corners_px[1].x() - frame.detections[0].corners_px[0].x(),
                500 * 0.24 / 1.98, 3);
  }
}

std::vector<Eigen::Vector2d> circle(double radius, int points) {
  std::vector<Eigen::Vector2d> result;
  for (int i = 0; i < points; ++i) {
    const double a = 2 * std::numbers::pi * i / points;
    result.emplace_back(radius * std::cos(a), radius * std::sin(a));
  }
  return result;
}

TEST(Path, ThroughPointsOfACircleApproximatesTheCircle) {
  const auto path = sample_path(circle(2.0, 60), true, 0.02);
  ASSERT_FALSE(path.empty());
  const double length = path.back().arc_length_m + path[1].arc_length_m;
  EXPECT_NEAR(length, 4 * std::numbers::pi, 1e-3);
  for (const PathPoint& point : path) {
    EXPECT_NEAR(point.map_T_path.translation().norm(), 2.0, 1e-4);
    EXPECT_NEAR(point.curvature_1_m, 0.5, 0.01);
  }
  EXPECT_TRUE(sample_path({{0, 0}, {1, 1}}, true, 0.02).empty());
}

constexpr Hull kSmall{.front_m = 0.2, .rear_m = 0.1, .width_m = 0.2, .height_m = 0.25};

World with_box(const Eigen::Vector3d& centre, const Eigen::Vector3d& size, double yaw = 0) {
  World world;
  world.occluders.push_back({.centre_m = centre, .yaw_rad = yaw, .size_m = size});
  return world;
}

TEST(ObstacleDistance, IsMeasuredFromTheHullNotFromBase) {
  const World world = with_box({1, 0, 0.5}, {1, 1, 1});
  EXPECT_NEAR(obstacle_distance_m(world, kSmall, SE2(0, 0, 0)), 0.3, 1e-12);
  EXPECT_NEAR(obstacle_distance_m(world, kSmall, SE2(0, 0, std::numbers::pi)), 0.4, 1e-12)
      << "its rear is nearer";
  EXPECT_EQ(obstacle_distance_m(world, kSmall, SE2(0.31, 0, 0)), 0);
  EXPECT_EQ(obstacle_distance_m(world, kSmall, SE2(1, 0, 1)), 0) << "inside";
  EXPECT_NEAR(obstacle_distance_m(world, kSmall, SE2(0, 0.9, 0)), std::hypot(0.3, 0.3), 1e-12)
      << "corner to corner";
}

TEST(ObstacleDistance, OfCrossingBoxesWithoutCornersInside) {
  // A long, thin plank across the hull, so that no corner of either is inside the other.
  const World world = with_box({0.05, 0, 0.1}, {2, 0.02, 0.2}, std::numbers::pi / 2);
  EXPECT_EQ(obstacle_distance_m(world, kSmall, SE2()), 0);
  const World leaning = with_box({1, 0, 0.1}, {std::sqrt(2.0), std::sqrt(2.0), 0.2}, std::numbers::pi / 4);
  EXPECT_EQ(obstacle_distance_m(leaning, kSmall, SE2()), 0) << "its corner is at the origin";
  EXPECT_NEAR(obstacle_distance_m(leaning, kSmall, SE2(-0.5, 0, 0)), 0.3, 1e-9);
}

TEST(ObstacleDistance, HighObjectsAreIgnored) {
  EXPECT_TRUE(std::isinf(obstacle_distance_m(with_box({0, 0, 1}, {1, 1, 1}), kSmall, SE2())));
  EXPECT_TRUE(std::isinf(obstacle_distance_m(World(), kSmall, SE2())));
  World walled;
  walled.walls.push_back({.from_m = {-1, 1}, .to_m = {1, 1}, .thickness_m = 0.1});
  EXPECT_NEAR(obstacle_distance_m(walled, kSmall, SE2()), 0.85, 1e-12);
}

}  // namespace
}  // namespace waymark
