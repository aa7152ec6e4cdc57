#include "waymark/app/localize/localize_robot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using ::testing::HasSubstr;

/// The error for a job that is rejected before its robot starts.
Error refused(const LocalizeRobotJob& job) {
  const auto setup = load_listening_robot(job);
  EXPECT_FALSE(setup);
  return setup ? Error{} : setup.error();
}

TEST(LocalizeRobot, RejectsContradictingValuesBeforeTheRobotStarts) {
  EXPECT_EQ(refused({.robot = "process:true", .images = "jpeg"}).place.key, "record_images");
  EXPECT_EQ(refused({.robot = "process:true", .image_settings = {.in_strips = true}}).place.key,
            "search_strips");
  EXPECT_EQ(refused({.robot = "process:true", .output = "estimate.xyz"}).place.key, "`output`");
  const Error no_delay = refused({.robot = "process:true", .method = LocalizationKind::Smoother});
  EXPECT_EQ(no_delay.place.key, "lag_s") << "a smoother without a delay would never finish";
}

TEST(LocalizeRobot, RejectsRobotsThatNoOtherProgramDrives) {
  for (const char* robot : {"limo", "sim", ""}) {
    const Error error = refused({.robot = robot});
    EXPECT_EQ(error.place.key, "robot");
    EXPECT_THAT(error.hint, HasSubstr("ros2:"));
    EXPECT_THAT(error.hint, testing::Not(HasSubstr("sim,")));
  }
}

TEST(LocalizeRobot, SendsNoCommands) {
  const auto setup = load_listening_robot({.robot = "process:true", .image_settings = {.search_every = 8}});
  ASSERT_TRUE(setup) << to_string(setup.error());
  EXPECT_TRUE(setup->process.listen_only);
  EXPECT_EQ(setup->image_settings.search_every, 8);
}

}  // namespace
}  // namespace waymark
