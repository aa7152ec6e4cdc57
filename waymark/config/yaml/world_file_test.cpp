#include "waymark/config/yaml/world_file.hpp"

#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/line_cuts.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

const std::string kSmall = R"(name: small
tag_family: tag36h11
tag_size_m: 0.16
anchor_id: 0
tags:
  - {id: 0, x_m: 1.0, y_m: 2.0, z_m: 0.3, facing_deg: 90}
path_closed: true
path_m:
  - [0, 0]
  - [1, 0]
  - [1, 1]
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

std::string error_of(const std::string& text) {
  const auto world = parse_world(text, "w.yaml");
  return world ? "none" : to_string(world.error());
}

TEST(WorldFile, ReadsAWorld) {
  const auto world = parse_world(kSmall, "w.yaml");
  ASSERT_TRUE(world) << to_string(world.error());
  EXPECT_EQ(world->name, "small");
  EXPECT_EQ(world->path_m.size(), 3U);
  const MappedTag* tag = world->tags.find({FamilyId::Tag36h11, 0});
  ASSERT_NE(tag, nullptr);
  EXPECT_TRUE(
      (tag->map_T_tag.rotation() * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d(0, -1, 0), 1e-12));
}

TEST(WorldFile, ReadsTheDefaultRobot) {
  EXPECT_EQ(robot_of_world(kSmall, "w.yaml").value(), "");
  const std::string with_robot = replaced(kSmall, "tag_family", "robot: mbot\ntag_family");
  EXPECT_TRUE(parse_world(with_robot, "w.yaml"));
  EXPECT_EQ(robot_of_world(with_robot, "w.yaml").value(), "mbot");
  EXPECT_FALSE(robot_of_world(replaced(kSmall, "tag_family", "robot: [mbot]\ntag_family"), "w.yaml"));
}

TEST(WorldFile, InvalidInputIsReportedWithFileLineAndKey) {
  EXPECT_TRUE(
      (error_of(replaced(kSmall, "anchor_id: 0", "anchor_id: 5"))).starts_with("w.yaml:4 (anchor_id): "));
  EXPECT_NE((error_of(replaced(kSmall, "anchor_id: 0", "anchor_id: 5"))).find("tag36h11:5"),
            std::string::npos);
  testing::expect_on_page("config", error_of(replaced(kSmall, "anchor_id: 0", "anchor_id: 5")));
  EXPECT_NE(error_of(replaced(kSmall, "facing_deg", "facing_dge")).find("facing_deg"), std::string::npos);
  EXPECT_NE(error_of(replaced(kSmall, "tag36h11", "tag36h12")).find("w.yaml:2 (tag_family)"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(kSmall, "0.16", "-1")).find("w.yaml:3 (tag_size_m)"), std::string::npos);
  EXPECT_NE(error_of(replaced(kSmall, "  - [1, 1]\n", "")).find("(path_m)"), std::string::npos);
  EXPECT_NE(error_of(replaced(kSmall, "[1, 1]", "[1]")).find("w.yaml:11"), std::string::npos);
  EXPECT_NE(error_of(replaced(kSmall, "x_m: 1.0", "x_m: 1e300")).find("(tags[0].x_m): 1e+300 is out"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(kSmall, "[1, 1]", "[1, -1e9]")).find("w.yaml:11 (path_m[2])"),
            std::string::npos);
  EXPECT_NE(error_of("").find("w.yaml"), std::string::npos);
}

TEST(WorldFile, ReadsPanelsWallsAndOccluders) {
  const std::string text = kSmall + R"(tag_margin_cells: 2
panels:
  - {x_m: 2, y_m: 0, z_m: 0.5, facing_deg: 180, width_m: 0.6, height_m: 0.3, tags: [{id: 7, right_m: 0.2, up_m: 0.05}]}
walls:
  - {from_m: [0, -1], to_m: [4, -1], height_m: 2}
occluders:
  - {x_m: 1, y_m: 1, yaw_deg: 90, length_m: 0.4, width_m: 0.2, height_m: 0.5}
keep_outs:
  - [[0, 0], [1, 0], [0, 1]]
floor: {texture: tiles, cell_m: 0.25}
)";
  const auto world = parse_world(text, "w.yaml");
  ASSERT_TRUE(world) << to_string(world.error());
  ASSERT_EQ(world->panels.size(), 1U);
  const MappedTag* tag = world->tags.find({FamilyId::Tag36h11, 7});
  ASSERT_NE(tag, nullptr);
  // For a viewer of a board that faces -x, map -y is on the right.
  EXPECT_TRUE(tag->map_T_tag.translation().isApprox(Eigen::Vector3d(2, -0.2, 0.55), 1e-12));
  ASSERT_EQ(world->walls.size(), 1U);
  EXPECT_EQ(as_box(world->walls[0]).size_m, Eigen::Vector3d(4, 0.1, 2));
  EXPECT_DOUBLE_EQ(world->occluders.at(0).centre_m.z(), 0.25) << "on the floor by default";
  EXPECT_EQ(world->keep_outs.at(0).corners_m.size(), 3U);
  EXPECT_EQ(world->floor.texture, "tiles");
  EXPECT_NE(error_of(replaced(text, "tiles", "tilse")).find("tiles"), std::string::npos);
  EXPECT_NE(error_of(replaced(text, "[4, -1]", "[0, -1]")).find("has no length"), std::string::npos);
  EXPECT_NE(error_of(replaced(text, "id: 7", "id: 0")).find("given twice"), std::string::npos);
  EXPECT_NE(error_of(replaced(text, "width_m: 0.2", "width_m: -2")).find("occluders[0].width_m"),
            std::string::npos);
}

TEST(WorldFile, RoundTrips) {
  auto world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml");
  ASSERT_TRUE(world);
  SE3& turned = world->tags.tags.begin()->second.map_T_tag;
  turned = turned * SE3(SO3::from_rpy(0, 0, 2), Eigen::Vector3d::Zero());
  world->occluders = {{.centre_m = {1, 2, 0.3}, .yaw_rad = 0.5, .size_m = {0.6, 0.4, 0.5}}};
  world->tag_margin_cells = 0.5;
  world->corners_through_paper = true;
  const auto back = parse_world(to_yaml(*world), "written");
  ASSERT_TRUE(back) << to_string(back.error());
  EXPECT_EQ(back->name, "circuit24");
  EXPECT_EQ(back->anchor, world->anchor);
  ASSERT_EQ(back->tags.tags.size(), world->tags.tags.size());
  for (const auto& [id, tag] : world->tags.tags) {
    const SE3 difference = tag.map_T_tag.inverse() * back->tags.find(id)->map_T_tag;
    EXPECT_LT(difference.log().norm(), 2e-3);
  }
  ASSERT_EQ(back->occluders.size(), 1U);
  EXPECT_LT((back->occluders[0].size_m - world->occluders[0].size_m).norm(), 1e-3);
  EXPECT_NEAR(back->occluders[0].yaw_rad, 0.5, 1e-3);
  EXPECT_EQ(back->tag_margin_cells, 0.5);
  EXPECT_TRUE(back->corners_through_paper);
  ASSERT_EQ(back->path_m.size(), world->path_m.size());
  EXPECT_LT((back->path_m.back() - world->path_m.back()).norm(), 1e-4);
}

TEST(WorldFile, RejectsCutsAtLineEnds) {
  auto world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml");
  ASSERT_TRUE(world);
  world->occluders = {{.centre_m = {1, 2, 0.3}, .yaw_rad = 0.5, .size_m = {0.6, 0.4, 0.5}}};
  const std::string text = to_yaml(*world);
  for (const std::string& cut : testing::cuts_at_line_ends(text))
    EXPECT_FALSE(parse_world(cut, "w.yaml")) << cut;
  const std::string added =
      replaced(text, "tags:\n", "tags:\n  - {id: 99, x_m: 9, y_m: 9, z_m: 1, facing_deg: 0}\n");
  EXPECT_TRUE(parse_world(added, "w.yaml")) << "tags may be added by hand";
}

TEST(Circuit24, HasItsDocumentedProperties) {
  const auto world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml");
  ASSERT_TRUE(world) << to_string(world.error());
  EXPECT_EQ(world->tags.tags.size(), 24U);
  const auto path = sample_path(world->path_m, world->path_closed, 0.02);
  const double length = path.back().arc_length_m + path[1].arc_length_m;
  EXPECT_GE(length, 16.0);
  const auto [low, high] = std::ranges::minmax(path, {}, &PathPoint::curvature_1_m);
  EXPECT_LT(low.curvature_1_m, -0.3) << "curves to the right";
  EXPECT_GT(high.curvature_1_m, 0.3) << "curves to the left";

  const Hull hull{.front_m = 0.161, .rear_m = 0.161, .width_m = 0.22, .height_m = 0.251};
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 442.17, .fy = 443.88, .cx = 323.5, .cy = 247}, 640, 480).value();
  const SE3 base_T_cam(SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished()),
                       {0.084, 0, 0.18});
  int two = 0;
  double clearance = 1e9;
  for (const PathPoint& point : path) {
    const SE3 map_T_base = lift(point.map_T_path);
    two += visible_tags(world->tags, camera, map_T_base * base_T_cam).size() >= 2 ? 1 : 0;
    clearance = std::min(clearance, clearance_m(hull, map_T_base, world->tags));
  }
  EXPECT_GE(two, 0.98 * static_cast<double>(path.size()));
  EXPECT_GE(clearance, 0.35);
}

}  // namespace
}  // namespace waymark
