#include "waymark/app/world/export_world.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/config/yaml/world_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

ExportWorldReport exported(World world, const std::string& folder) {
  const auto report = export_world({.world = std::move(world),
                                    .robot = read_robot(WAYMARK_SHARE "/robots/limo-gazebo.yaml").value(),
                                    .folder = testing::fresh_folder("jobs_export_words") / folder});
  EXPECT_TRUE(report) << to_string(report.error());
  return report.value_or(ExportWorldReport{});
}

TEST(ExportWorld, PrintsTheTeachCommandWithAnchorAndSize) {
  const World world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml").value();
  EXPECT_THAT(to_text(exported(world, "named"), "named"), HasSubstr("--anchor tag36h11:0 --tag-size-m 0.16"));

  World unnamed = world;
  unnamed.anchor = {FamilyId::Tag36h11, 500};
  EXPECT_THAT(to_text(exported(unnamed, "unnamed"), "unnamed"),
              HasSubstr("--anchor tag36h11:0 --tag-size-m 0.16"))
      << "the first tag becomes the anchor";

  World bare = world;
  bare.tags.tags.clear();
  const std::string text = to_text(exported(bare, "bare"), "bare");
  EXPECT_THAT(text, Not(HasSubstr("--tag-size-m")));
  EXPECT_THAT(text, HasSubstr("no tag"));
}

ExportWorldJob export_job(const fs::path& folder) {
  return {.world = test::circuit(),
          .robot = test::limo(),
          .robot_yaml = test::file_text(WAYMARK_SHARE "/robots/limo.yaml"),
          .folder = folder};
}

TEST(ExportWorld, WritesWorldTagsRobotAndProfile) {
  const fs::path folder = testing::fresh_folder("jobs_export") / "my world";
  const auto report = export_world(export_job(folder));
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->tags, test::circuit().tags.tags.size());
  EXPECT_EQ(report->anchor, to_string(test::circuit().anchor));
  EXPECT_NEAR(report->tag_size_m, 0.16, 1e-9);
  EXPECT_EQ(test::names_in(folder).size(), report->files.size());
  for (const std::string& file : report->files) EXPECT_TRUE(fs::exists(folder / file)) << file;
  EXPECT_TRUE(read_robot(folder / "robot.yaml")) << "the robot file is copied unchanged";
  const std::string text = to_text(*report, folder);
  EXPECT_THAT(text,
              AllOf(HasSubstr("ign gazebo -r '"), HasSubstr("--tag-size-m 0.16"), HasSubstr("24 tags")));
  EXPECT_EQ(to_json(fields(*report))["files"].size(), report->files.size());
}

TEST(ExportWorld, RejectsANonEmptyFolder) {
  const fs::path folder = testing::fresh_folder("jobs_export_full");
  std::ofstream(folder / "mine.txt") << "mine";
  const auto report = export_world(export_job(folder));
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::Unwritable);
  EXPECT_EQ(report.error().place.source, folder.string());
  EXPECT_FALSE(report.error().hint.empty());
  EXPECT_THAT(test::names_in(folder), ElementsAre("mine.txt"));
}

}  // namespace
}  // namespace waymark
