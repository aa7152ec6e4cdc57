#include "waymark/app/world/import_world.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/sdf/write_sdf.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A scene of upright planes, each of which has a tag as its texture.
struct PaintedScene {
  fs::path folder;
  SdfScene scene{.name = "painted"};

  explicit PaintedScene(const std::string& name) : folder(testing::fresh_folder(name)) {
    for (const SdfTexture& texture : write_sdf_world(test::circuit(), test::limo()).textures)
      EXPECT_TRUE(write_image((folder / texture.name).string(), texture.image.view()));
  }
  std::string texture(int number) const { return (folder / fmt::format("tag36h11_{}.png", number)).string(); }
  /// Adds a plane with a tag, one metre above the floor, with its normal along x.
  void add_tag(int number, double y_m, double size_m = 0.2) {
    SdfVisual plane{.name = fmt::format("tag{}::link::visual", number),
                    .world_T_visual = SE3({}, {2, y_m, 1}),
                    .shape = SdfShape::Plane,
                    .size_m = {size_m, size_m, 0},
                    .visual_n_plane = Eigen::Vector3d::UnitX(),
                    .texture = texture(number)};
    scene.visuals.push_back(plane);
  }
  void add_shape(const std::string& name, SdfShape shape, const Eigen::Vector3d& size_m,
                 const SE3& world_T_visual) {
    scene.visuals.push_back({.name = name,
                             .world_T_visual = world_T_visual,
                             .shape = shape,
                             .size_m = size_m,
                             .reflectance = 0.3});
  }
};

TEST(WorldOfSdf, PlacesTagsAtTheirTextures) {
  PaintedScene painted("jobs_import_tags");
  ASSERT_TRUE(fs::exists(painted.texture(3))) << test::names_in(painted.folder).front();
  painted.add_tag(3, 0);
  painted.add_tag(7, 0.5);
  std::vector<std::string> warnings;
  const auto world = world_of(painted.scene, {"tag36h11"}, warnings);
  ASSERT_TRUE(world) << to_string(world.error());
  EXPECT_THAT(warnings, IsEmpty());
  ASSERT_EQ(world->tags.tags.size(), 2U);
  const MappedTag& three = world->tags.tags.at({FamilyId::Tag36h11, 3});
  EXPECT_LT((three.map_T_tag.translation() - Eigen::Vector3d(2, 0, 1)).norm(), 0.005);
  EXPECT_LT((three.map_T_tag.rotation() * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitX()).norm(), 0.02)
      << "the z axis points into the wall";
  EXPECT_LT(three.size_m, 0.2) << "the white margin is not part of the tag";
  EXPECT_EQ(world->anchor.number, 3);
  EXPECT_THAT(world->occluders, IsEmpty());
}

TEST(WorldOfSdf, KeepsTheFirstOfDuplicateTags) {
  PaintedScene painted("jobs_import_twice");
  painted.add_tag(3, 0);
  painted.add_tag(3, 1);
  std::vector<std::string> warnings;
  const auto world = world_of(painted.scene, {"tag36h11"}, warnings);
  ASSERT_TRUE(world);
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("tag36h11:3")));
  EXPECT_NEAR(world->tags.tags.at({FamilyId::Tag36h11, 3}).map_T_tag.translation().y(), 0, 0.005);
}

TEST(WorldOfSdf, ShapesBecomeUprightFurniture) {
  PaintedScene painted("jobs_import_furniture");
  painted.add_tag(3, 0);
  painted.add_shape("crate", SdfShape::Box, {1, 2, 3}, SE3(SO3::from_rpy(0, 0, 0.5), {5, 0, 1.5}));
  painted.add_shape("column", SdfShape::Cylinder, {0.4, 0.4, 2}, SE3({}, {6, 0, 1}));
  painted.add_shape("ramp", SdfShape::Box, {2, 1, 0.1}, SE3(SO3::from_rpy(0, 0.5, 0), {7, 0, 0.5}));
  painted.add_shape("floor slab", SdfShape::Box, {9, 9, 0.1}, SE3({}, {0, 0, -0.05}));
  painted.add_shape("dust", SdfShape::Sphere, {1e-5, 1e-5, 1e-5}, SE3({}, {8, 0, 1}));
  painted.scene.visuals.push_back(
      {.name = "cart::link::visual", .shape = SdfShape::Box, .size_m = {1, 1, 1}, .fixed = false});
  std::vector<std::string> warnings;
  const auto world = world_of(painted.scene, {"tag36h11"}, warnings);
  ASSERT_TRUE(world);
  ASSERT_EQ(world->occluders.size(), 3U);
  EXPECT_NEAR(world->occluders[0].yaw_rad, 0.5, 1e-9);
  EXPECT_LT((world->occluders[0].size_m - Eigen::Vector3d(1, 2, 3)).norm(), 1e-9);
  EXPECT_GT(world->occluders[2].size_m.z(), 0.5) << "this is the bounding box of the ramp";
  EXPECT_THAT(warnings, Contains(HasSubstr("2 shapes")));
  EXPECT_THAT(warnings, Contains(HasSubstr("dust")));
  EXPECT_THAT(warnings, Contains(HasSubstr("cart")));
}

TEST(WorldOfSdf, FailsWithoutAReadableTag) {
  PaintedScene painted("jobs_import_none");
  painted.add_shape("crate", SdfShape::Box, {1, 1, 1}, SE3());
  std::vector<std::string> warnings;
  const auto world = world_of(painted.scene, {"tag36h11"}, warnings);
  ASSERT_FALSE(world);
  EXPECT_EQ(world.error().code, ErrorCode::NotFound);
  EXPECT_THAT(to_string(world.error()), AllOf(HasSubstr("0 of 1 visuals"), HasSubstr("`family`")));
  EXPECT_FALSE(world_of(painted.scene, {"tag99h1"}, warnings));
}

TEST(ImportWorld, ReportsAnUnwritableOutputBeforeReading) {
  const auto report = import_world({.file = "/nowhere/world.sdf", .output = "/nowhere/world.yaml"}, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::Unwritable);
  EXPECT_EQ(report.error().place.source, "/nowhere/world.yaml");
}

TEST(ImportWorld, JsonCountsTheImportedParts) {
  const auto json = to_json(fields(
      ImportWorldReport{.file = "walls.yaml", .world = test::circuit(), .lights = {"sun"}, .warnings = {}}));
  EXPECT_EQ(json["file"], "walls.yaml");
  EXPECT_EQ(json["tags"], 24);
  EXPECT_EQ(json["lights"].dump(), R"(["sun"])");
  EXPECT_EQ(json["warnings"].dump(), "[]");
}

}  // namespace
}  // namespace waymark
