#include "waymark/app/world/export_world.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/config/world_file.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ExportWorldReport exported(World world, const std::string& folder) {
  const auto report = export_world({.world = std::move(world),
                                    .robot = read_robot(WAYMARK_SHARE "/robots/limo-gazebo.yaml").value(),
                                    .folder = testing::fresh_folder("jobs_export_words") / folder});
  EXPECT_TRUE(report) << to_string(report.error());
  return report.value_or(ExportWorldReport{});
}

TEST(ExportWorld, SaysHowToTeachInIt) {
  const World world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml").value();
  EXPECT_THAT(to_text(exported(world, "named"), "named"), HasSubstr("--anchor tag36h11:0 --tag-size-m 0.16"));

  World unnamed = world;
  unnamed.anchor = {FamilyId::Tag36h11, 500};
  EXPECT_THAT(to_text(exported(unnamed, "unnamed"), "unnamed"),
              HasSubstr("--anchor tag36h11:0 --tag-size-m 0.16"))
      << "its first tag";

  World bare = world;
  bare.tags.tags.clear();
  const std::string text = to_text(exported(bare, "bare"), "bare");
  EXPECT_THAT(text, Not(HasSubstr("--tag-size-m")));
  EXPECT_THAT(text, HasSubstr("it has no tag to be the anchor"));
}

}  // namespace
}  // namespace waymark
