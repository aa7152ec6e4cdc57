#include "waymark/simulation/collision.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace waymark {
namespace {

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

TEST(ObstacleDistance, OfTurnedBoxesThatOnlyCrossWithoutCornersInside) {
  // A long thin plank across the hull: no corner of either lies in the other.
  const World world = with_box({0.05, 0, 0.1}, {2, 0.02, 0.2}, std::numbers::pi / 2);
  EXPECT_EQ(obstacle_distance_m(world, kSmall, SE2()), 0);
  const World leaning = with_box({1, 0, 0.1}, {std::sqrt(2.0), std::sqrt(2.0), 0.2}, std::numbers::pi / 4);
  EXPECT_EQ(obstacle_distance_m(leaning, kSmall, SE2()), 0) << "its corner is at the origin";
  EXPECT_NEAR(obstacle_distance_m(leaning, kSmall, SE2(-0.5, 0, 0)), 0.3, 1e-9);
}

TEST(ObstacleDistance, WhatHangsHighIsNotMet) {
  EXPECT_TRUE(std::isinf(obstacle_distance_m(with_box({0, 0, 1}, {1, 1, 1}), kSmall, SE2())));
  EXPECT_TRUE(std::isinf(obstacle_distance_m(World(), kSmall, SE2())));
  World walled;
  walled.walls.push_back({.from_m = {-1, 1}, .to_m = {1, 1}, .thickness_m = 0.1});
  EXPECT_NEAR(obstacle_distance_m(walled, kSmall, SE2()), 0.85, 1e-12);
}

}  // namespace
}  // namespace waymark
