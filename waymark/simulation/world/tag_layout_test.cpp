#include "waymark/simulation/world/tag_layout.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "waymark/simulation/world/world_check.hpp"

namespace waymark {
namespace {

RobotModel robot() {
  const Eigen::Matrix3d optical = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  return {.hull = {.front_m = 0.16, .rear_m = 0.16, .width_m = 0.22, .height_m = 0.25},
          .base_T_cam = SE3(SO3::from_matrix(optical), {0.084, 0, 0.18})};
}

CameraModel camera() {
  return CameraModel::make(PinholeRadtan{.fx = 442, .fy = 443, .cx = 320, .cy = 240}, 640, 480).value();
}

World circle(double radius_m) {
  World world{.name = "circle"};
  for (int i = 0; i < 40; ++i) {
    const double a = 2 * std::numbers::pi * i / 40;
    world.path_m.emplace_back(radius_m * std::cos(a), radius_m * std::sin(a));
  }
  return world;
}

TEST(TagLayout, TwoTagsAreVisibleEverywhereWithClearance) {
  const auto world = lay_tags(circle(2), robot(), camera());
  ASSERT_TRUE(world) << to_string(world.error());
  const auto check = check_world(*world, robot(), camera());
  ASSERT_TRUE(check);
  std::printf("%zu tags, two in view from %.1f %%, clearance %.3f m\n", world->tags.tags.size(),
              100 * check->two_tags_fraction, check->min_clearance_m);
  EXPECT_GE(check->two_tags_fraction, 0.98);
  EXPECT_GE(check->min_clearance_m, 0.44);
  EXPECT_LE(world->tags.tags.size(), 30U);
  EXPECT_NE(world->tags.find(world->anchor), nullptr);
  // The anchor is in view at the beginning of the lap.
  const auto seen = visible_tags(world->tags, camera(),
                                 SE3(SO3::exp({0, 0, std::numbers::pi / 2}), {2, 0, 0}) * robot().base_T_cam);
  EXPECT_NE(std::ranges::find(seen, world->anchor), seen.end());
}

/// An S-shaped line whose halves are in view of each other.
World winding() {
  World world{.name = "winding", .path_closed = false};
  for (int i = 0; i < 120; ++i)
    world.path_m.emplace_back(0.08 * i, 1.2 * std::sin(2 * std::numbers::pi * i / 40));
  return world;
}

TEST(TagLayout, NoTagHidesAnotherFromTheLine) {
  for (const World& line : {circle(2), circle(1.3), winding()}) {
    const auto world = lay_tags(line, robot(), camera());
    ASSERT_TRUE(world) << to_string(world.error());
    const auto check =
        check_world(*world, robot(), camera(), {.max_range_m = TagLayoutOptions{}.max_range_m});
    ASSERT_TRUE(check);
    std::printf("%s: %zu tags, two in view from %.1f %%\n", line.name.c_str(), world->tags.tags.size(),
                100 * check->two_tags_fraction);
    EXPECT_TRUE(check->overlapping.empty());
    double hidden_m = 0;
    for (const HiddenTag& tag : check->hidden) hidden_m += tag.from_m;
    // The layout samples the line every 5 cm and the check every 2 cm, so an occlusion between two layout
    // samples is short.
    EXPECT_LE(hidden_m, 0.05 * static_cast<double>(check->hidden.size()));
  }
}

TEST(TagLayout, RespectsKeepOutAreasAndWalls) {
  World ring = circle(2);
  ring.keep_outs.push_back({{{-1.9, -1.9}, {1.9, -1.9}, {1.9, 1.9}, {-1.9, 1.9}}});
  const auto outside = lay_tags(ring, robot(), camera());
  ASSERT_TRUE(outside);
  for (const auto& [id, tag] : outside->tags.tags)
    EXPECT_FALSE(inside(ring.keep_outs[0], tag.map_T_tag.translation().head<2>())) << id.number;
  World none = circle(2);
  none.keep_outs.push_back({{{-9, -9}, {9, -9}, {9, 9}, {-9, 9}}});
  EXPECT_FALSE(lay_tags(none, robot(), camera()));
  EXPECT_FALSE(lay_tags(World{.name = "no line"}, robot(), camera()));
}

}  // namespace
}  // namespace waymark
