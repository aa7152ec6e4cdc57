#include "waymark/app/world/judge_world.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

TEST(JudgeWorld, AcceptsTheCircuitAndRejectsWrongUnitsAndTooFewTags) {
  const RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo.yaml").value();
  const auto good = judge_world(test::circuit(), robot.model, robot.camera, {});
  ASSERT_TRUE(good) << to_string(good.error());
  EXPECT_TRUE(good->good);
  EXPECT_NE(nearest_tag(good->check), "no tag");
  const auto json = to_json(fields(*good));
  EXPECT_EQ(json["tags"], 24);
  EXPECT_GE(json["two_tags_fraction"].get<double>(), kGoodLapTwoTags);
  World large_tag = test::circuit();
  large_tag.tags.tags.begin()->second.size_m = 160;
  const auto too_large = judge_world(large_tag, robot.model, robot.camera, {});
  ASSERT_TRUE(too_large);
  EXPECT_FALSE(too_large->good);
  EXPECT_THAT(too_large->warnings, Contains(HasSubstr("millimetres")));
  World sparse = test::circuit();
  while (sparse.tags.tags.size() > 2) sparse.tags.tags.erase(std::prev(sparse.tags.tags.end()));
  EXPECT_FALSE(judge_world(sparse, robot.model, robot.camera, {})->good) << "too few tags are in view";
}

TEST(JudgeWorld, WarnsOnceAboutASizeInMillimetres) {
  World world = test::circuit();
  const RobotDescription robot = test::limo();
  const auto good = judge_world(world, robot.model, robot.camera, {});
  ASSERT_TRUE(good) << to_string(good.error());
  EXPECT_TRUE(good->good);
  EXPECT_EQ(to_json(fields(*good))["good"], true);
  world.tags.tags.begin()->second.size_m = 160;
  const auto wrong_unit = judge_world(world, robot.model, robot.camera, {});
  ASSERT_TRUE(wrong_unit);
  EXPECT_FALSE(wrong_unit->good);
  ASSERT_EQ(wrong_unit->warnings.size(), 1U);
  EXPECT_THAT(wrong_unit->warnings.front(), HasSubstr("millimetres"));
}

TEST(JudgeWorld, NamesOverlappingTags) {
  World world = test::circuit();
  const RobotDescription robot = test::limo();
  const TagId anchor = world.anchor;
  const TagId second{anchor.family, 500};
  world.tags.tags[second] = *world.tags.find(anchor);
  world.tags.tags[second].map_T_tag = world.tags.find(anchor)->map_T_tag * SE3({}, {0.05, 0, 0});
  const auto verdict = judge_world(world, robot.model, robot.camera, {});
  ASSERT_TRUE(verdict);
  EXPECT_FALSE(verdict->good);
  ASSERT_EQ(verdict->warnings.size(), 1U);
  EXPECT_THAT(verdict->warnings.front(),
              HasSubstr(to_string(anchor) + " and " + to_string(second) + " overlap"));
  EXPECT_EQ(to_json(fields(*verdict))["overlapping_tags"][0][1], to_string(second));
}

/// Tags whose corners are visible and whose centres are not hidden by walls. Occlusion by other tags is
/// ignored.
std::vector<TagId> in_view_ignoring_paper(const World& world, const CameraModel& camera,
                                          const SE3& map_T_cam) {
  std::vector<TagId> tags;
  for (const TagCopy& tag : readable_tags(world)) {
    const Eigen::Vector3d& centre = tag.placed.map_T_tag.translation();
    const SE3 cam_T_tag = map_T_cam.inverse() * tag.placed.map_T_tag;
    if (cam_T_tag.translation().norm() <= TagCameraOptions{}.max_range_m &&
        visible_corners(camera, cam_T_tag, tag.placed.size_m) &&
        line_of_sight(world, map_T_cam.translation(), centre))
      tags.push_back(tag.tag);
  }
  return tags;
}

TEST(BuiltInWorlds, NoTagHidesAnotherFromTheCornerCamera) {
  const RobotDescription robot = test::limo();
  Random random(3);
  for (const char* name : {"circuit24", "limo-walls", "mbot-square", "academy-house"}) {
    const auto world = read_world(std::string(WAYMARK_SHARE "/worlds/") + name + ".yaml");
    ASSERT_TRUE(world) << to_string(world.error());
    int seen = 0;
    for (const PathPoint& point : sample_path(world->path_m, world->path_closed, 0.05)) {
      const SE2 aside = point.map_T_path * SE2::exp({0, 0.05 * random.normal(), 0.05 * random.normal()});
      const SE3 map_T_cam = lift(aside) * robot.model.base_T_cam;
      std::vector<TagId> tags;
      for (const TagDetection& tag :
           see_tags(*world, robot.camera, map_T_cam, SensorTime{}, {.miss_probability = 0}, random)
               .detections)
        tags.push_back(tag.tag);
      EXPECT_EQ(tags, in_view_ignoring_paper(*world, robot.camera, map_T_cam)) << name;
      seen += static_cast<int>(tags.size());
    }
    EXPECT_GT(seen, 20) << name;
    const auto verdict = judge_world(*world, robot.model, robot.camera, {});
    ASSERT_TRUE(verdict);
    EXPECT_TRUE(verdict->check.overlapping.empty()) << name;
    EXPECT_EQ(verdict->check.hidden.empty(), !world->corners_through_paper) << name;
  }
}

TEST(Orbit, ReportsAndPlotsTheResult) {
  const fs::path folder = testing::fresh_folder("jobs_orbit");
  const auto report = orbit(test::circuit(), {.steps = 36});
  ASSERT_TRUE(report);
  const auto json = to_json(fields(WorldOrbit{test::circuit().name, *report}));
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

}  // namespace
}  // namespace waymark
