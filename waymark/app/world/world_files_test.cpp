// Worlds written for Gazebo, taken from SDF and from recordings, and a camera that goes round one.
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/app/world/export_world.hpp"
#include "waymark/app/world/import_world.hpp"
#include "waymark/app/world/judge_world.hpp"
#include "waymark/app/world/world_from_recording.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/sdf/write_sdf_world.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

ExportWorldJob export_job(const fs::path& folder) {
  return {.world = test::circuit(),
          .robot = test::limo(),
          .robot_yaml = test::file_text(WAYMARK_SHARE "/robots/limo.yaml"),
          .folder = folder};
}

TEST(ExportWorld, WritesAWorldItsTagsTheRobotAndItsProfile) {
  const fs::path folder = testing::fresh_folder("jobs_export") / "my world";
  const auto report = export_world(export_job(folder));
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->tags, test::circuit().tags.tags.size());
  EXPECT_EQ(report->anchor, to_string(test::circuit().anchor));
  EXPECT_NEAR(report->tag_size_m, 0.16, 1e-9);
  EXPECT_EQ(test::names_in(folder).size(), report->files.size());
  for (const std::string& file : report->files) EXPECT_TRUE(fs::exists(folder / file)) << file;
  EXPECT_TRUE(read_robot(folder / "robot.yaml")) << "as it was given";
  const std::string text = to_text(*report, folder);
  EXPECT_THAT(text,
              AllOf(HasSubstr("ign gazebo -r '"), HasSubstr("--tag-size-m 0.16"), HasSubstr("24 tags")));
  EXPECT_EQ(to_json(*report)["files"].size(), report->files.size());
}

TEST(ExportWorld, AFolderThatHoldsSomethingIsLeftAsItIs) {
  const fs::path folder = testing::fresh_folder("jobs_export_full");
  std::ofstream(folder / "mine.txt") << "mine";
  const auto report = export_world(export_job(folder));
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::Unwritable);
  EXPECT_EQ(report.error().place.source, folder.string());
  EXPECT_THAT(report.error().hint, HasSubstr("not there yet"));
  EXPECT_THAT(test::names_in(folder), ElementsAre("mine.txt"));
}

/// A scene of upright planes, each with the picture of a tag.
struct PaintedScene {
  fs::path folder;
  SdfScene scene{.name = "painted"};

  explicit PaintedScene(const std::string& name) : folder(testing::fresh_folder(name)) {
    for (const SdfTexture& texture : write_sdf_world(test::circuit(), test::limo()).textures)
      EXPECT_TRUE(write_image((folder / texture.name).string(), texture.image.view()));
  }
  std::string texture(int number) const { return (folder / fmt::format("tag36h11_{}.png", number)).string(); }
  /// A plane that looks along x, a metre above the floor.
  void hang(int number, double y_m, double size_m = 0.2) {
    SdfVisual plane{.name = fmt::format("tag{}::link::visual", number),
                    .world_T_visual = SE3({}, {2, y_m, 1}),
                    .shape = SdfShape::Plane,
                    .size_m = {size_m, size_m, 0},
                    .visual_n_plane = Eigen::Vector3d::UnitX(),
                    .texture = texture(number)};
    scene.visuals.push_back(plane);
  }
  void put(const std::string& name, SdfShape shape, const Eigen::Vector3d& size_m,
           const SE3& world_T_visual) {
    scene.visuals.push_back({.name = name,
                             .world_T_visual = world_T_visual,
                             .shape = shape,
                             .size_m = size_m,
                             .reflectance = 0.3});
  }
};

TEST(WorldOfSdf, TagsAreWhereTheirPicturesAre) {
  PaintedScene painted("jobs_import_tags");
  ASSERT_TRUE(fs::exists(painted.texture(3))) << test::names_in(painted.folder).front();
  painted.hang(3, 0);
  painted.hang(7, 0.5);
  std::vector<std::string> warnings;
  const auto world = world_of(painted.scene, {"tag36h11"}, warnings);
  ASSERT_TRUE(world) << to_string(world.error());
  EXPECT_THAT(warnings, IsEmpty());
  ASSERT_EQ(world->tags.tags.size(), 2U);
  const MappedTag& three = world->tags.tags.at({FamilyId::Tag36h11, 3});
  EXPECT_LT((three.map_T_tag.translation() - Eigen::Vector3d(2, 0, 1)).norm(), 0.005);
  EXPECT_LT((three.map_T_tag.rotation() * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitX()).norm(), 0.02)
      << "into the wall";
  EXPECT_LT(three.size_m, 0.2) << "within its white margin";
  EXPECT_EQ(world->anchor.number, 3);
  EXPECT_THAT(world->occluders, IsEmpty());
}

TEST(WorldOfSdf, AnIdThatIsThereTwiceCountsOnce) {
  PaintedScene painted("jobs_import_twice");
  painted.hang(3, 0);
  painted.hang(3, 1);
  std::vector<std::string> warnings;
  const auto world = world_of(painted.scene, {"tag36h11"}, warnings);
  ASSERT_TRUE(world);
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("tag36h11:3 is there more than once")));
  EXPECT_NEAR(world->tags.tags.at({FamilyId::Tag36h11, 3}).map_T_tag.translation().y(), 0, 0.005);
}

TEST(WorldOfSdf, ShapesBecomeUprightFurniture) {
  PaintedScene painted("jobs_import_furniture");
  painted.hang(3, 0);
  painted.put("crate", SdfShape::Box, {1, 2, 3}, SE3(SO3::from_rpy(0, 0, 0.5), {5, 0, 1.5}));
  painted.put("column", SdfShape::Cylinder, {0.4, 0.4, 2}, SE3({}, {6, 0, 1}));
  painted.put("ramp", SdfShape::Box, {2, 1, 0.1}, SE3(SO3::from_rpy(0, 0.5, 0), {7, 0, 0.5}));
  painted.put("floor slab", SdfShape::Box, {9, 9, 0.1}, SE3({}, {0, 0, -0.05}));
  painted.put("dust", SdfShape::Sphere, {1e-5, 1e-5, 1e-5}, SE3({}, {8, 0, 1}));
  painted.scene.visuals.push_back(
      {.name = "cart::link::visual", .shape = SdfShape::Box, .size_m = {1, 1, 1}, .fixed = false});
  std::vector<std::string> warnings;
  const auto world = world_of(painted.scene, {"tag36h11"}, warnings);
  ASSERT_TRUE(world);
  ASSERT_EQ(world->occluders.size(), 3U);
  EXPECT_NEAR(world->occluders[0].yaw_rad, 0.5, 1e-9);
  EXPECT_LT((world->occluders[0].size_m - Eigen::Vector3d(1, 2, 3)).norm(), 1e-9);
  EXPECT_GT(world->occluders[2].size_m.z(), 0.5) << "the box around a ramp";
  EXPECT_THAT(warnings, Contains(HasSubstr("2 shapes that are no upright boxes")));
  EXPECT_THAT(warnings, Contains(HasSubstr("dust is left out")));
  EXPECT_THAT(warnings, Contains(HasSubstr("cart is left out: it is not static")));
}

TEST(WorldOfSdf, WithoutATagThereIsNoWorld) {
  PaintedScene painted("jobs_import_none");
  painted.put("crate", SdfShape::Box, {1, 1, 1}, SE3());
  std::vector<std::string> warnings;
  const auto world = world_of(painted.scene, {"tag36h11"}, warnings);
  ASSERT_FALSE(world);
  EXPECT_EQ(world.error().code, ErrorCode::NotFound);
  EXPECT_THAT(to_string(world.error()),
              AllOf(HasSubstr("0 of 1 visuals have a texture"), HasSubstr("--family")));
  EXPECT_FALSE(world_of(painted.scene, {"tag99h1"}, warnings));
}

TEST(ImportWorld, AnOutputThatCannotBeIsSaidBeforeAnythingIsRead) {
  const auto report = import_world({.file = "/nowhere/world.sdf", .output = "/nowhere/world.yaml"}, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::Unwritable);
  EXPECT_EQ(report.error().place.source, "/nowhere/world.yaml");
}

TEST(Orbit, IsToldAndDrawnAsAsked) {
  const fs::path folder = testing::fresh_folder("jobs_orbit");
  const auto report = orbit(test::circuit(), {.steps = 36});
  ASSERT_TRUE(report);
  const auto json = to_json(*report, test::circuit());
  EXPECT_EQ(json["steps"], 36);
  EXPECT_EQ(json["good"], true);
  EXPECT_THAT(to_text(*report, test::circuit()), AllOf(HasSubstr("36 steps"), HasSubstr("below 1e-12: yes")));
  for (const char* name : {"orbit.svg", "orbit.png", "orbit.pdf"}) {
    ASSERT_TRUE(write_orbit((folder / name).string(), test::circuit(), *report)) << name;
    EXPECT_GT(fs::file_size(folder / name), 1000U) << name;
  }
  EXPECT_FALSE(write_orbit((folder / "orbit.gif").string(), test::circuit(), *report));
  EXPECT_FALSE(write_orbit("/nowhere/orbit.svg", test::circuit(), *report));
}

/// Fifteen seconds of a lap, and the map of them.
struct MappedDrive {
  fs::path folder = testing::fresh_folder("jobs_world_from");
  std::string lap = test::record_lap(folder / "lap.mcap", 31, {.for_s = 15});
  fs::path map = folder / "map";
  MappedDrive() { EXPECT_TRUE(map_recording({.lap = lap, .folder = map}, {})); }
};

const MappedDrive& mapped_drive() {
  static const MappedDrive made;
  return made;
}

TEST(WorldFromRecording, HoldsTheTagsTheRouteAndHowTheRobotBehaved) {
  const fs::path folder = mapped_drive().folder / "world";
  const auto report = world_from_recording(
      {.recording = mapped_drive().lap, .map = mapped_drive().map, .folder = folder}, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_THAT(report->files, ElementsAre("world.yaml", "robot.yaml"));
  const auto world = read_world(folder / "world.yaml");
  ASSERT_TRUE(world) << to_string(world.error());
  EXPECT_EQ(world->tags.tags.size(), report->world.tags.tags.size());
  EXPECT_GE(world->path_m.size(), 10U);
  for (const auto& [id, tag] : world->tags.tags)
    EXPECT_LT((tag.map_T_tag.translation() - test::circuit().tags.find(id)->map_T_tag.translation())
                  .head<2>()
                  .norm(),
              0.1)
        << id.number;
  const auto robot = read_robot(folder / "robot.yaml");
  ASSERT_TRUE(robot) << to_string(robot.error());
  EXPECT_NEAR(robot->simulation.camera_rate_hz, test::limo().simulation.camera_rate_hz, 1);
  const std::string text = to_text(*report, folder);
  EXPECT_THAT(text, AllOf(HasSubstr("waymark teach --world "), HasSubstr("not determined")));
  const auto json = to_json(*report);
  EXPECT_TRUE(json["quantities"]["camera.exposure_ms"].is_null()) << "there are no pictures";
}

TEST(WorldFromRecording, AMapOfAnotherDriveIsRefused) {
  const std::string other =
      test::record_lap(mapped_drive().folder / "other.mcap", 32, {.for_s = 3, .odometry = true});
  // The same place at the same times, its tags seen elsewhere: another map's tags are moved.
  const fs::path moved = mapped_drive().folder / "moved";
  fs::copy(mapped_drive().map, moved);
  MapFile map = read_map(moved / "map.yaml").value();
  for (auto& [id, tag] : map.tags.tags) tag.map_T_tag = SE3({}, {0, 0, 0.7}) * tag.map_T_tag;
  ASSERT_TRUE(write_map(moved / "map.yaml", map));
  const fs::path folder = mapped_drive().folder / "refused";
  const auto report = world_from_recording({.recording = other, .map = moved, .folder = folder}, {});
  ASSERT_FALSE(report);
  EXPECT_THAT(report.error().message, HasSubstr("its tags are not where they were seen"));
  EXPECT_THAT(report.error().hint, HasSubstr("waymark map "));
  EXPECT_FALSE(fs::exists(folder)) << "nothing is left of it";
}

TEST(WorldFromRecording, WhatIsMissingIsNamedAndCancellingLeavesNothing) {
  const fs::path folder = mapped_drive().folder / "none";
  const auto no_map =
      world_from_recording({.recording = mapped_drive().lap, .map = "/nowhere", .folder = folder}, {});
  ASSERT_FALSE(no_map);
  EXPECT_THAT(to_string(no_map.error()), HasSubstr("/nowhere"));
  const fs::path bare = mapped_drive().folder / "bare";
  fs::copy(mapped_drive().map, bare);
  fs::remove(bare / "robot.yaml");
  const auto no_robot =
      world_from_recording({.recording = mapped_drive().lap, .map = bare, .folder = folder}, {});
  ASSERT_FALSE(no_robot);
  EXPECT_THAT(no_robot.error().hint, HasSubstr("--robot"));
  for (const int questions : {0, 5, 200}) {
    EXPECT_FALSE(
        world_from_recording({.recording = mapped_drive().lap, .map = mapped_drive().map, .folder = folder},
                             test::cancelled_after(questions)))
        << questions;
    EXPECT_FALSE(fs::exists(folder)) << questions;
  }
}

}  // namespace
}  // namespace waymark
