#include "waymark/app/localize/localize_live.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using ::testing::HasSubstr;

TEST(LocalizeKind, IsToldByTheNames) {
  EXPECT_EQ(localize_kind({.logs = {"lap.mcap", "lap2.mcap"}}, false), LocalizeInput::Recording);
  EXPECT_EQ(localize_kind({.logs = {"walk.mp4"}}, true), LocalizeInput::Video);
  EXPECT_EQ(localize_kind({.logs = {"v4l2:/dev/video0"}}, true), LocalizeInput::Camera);
  EXPECT_EQ(localize_kind({.robot = "ros2:limo"}, false), LocalizeInput::Robot);
  EXPECT_EQ(localize_kind({.logs = {"lap.mcap"}, .robot = "limo"}, false), LocalizeInput::Recording)
      << "the name of a robot's description";
}

TEST(LocalizeKind, InputsThatDoNotGoTogetherAreRefused) {
  const auto words = [](const LocalizeJob& job) { return to_string(localize_kind(job, true).error()); };
  EXPECT_THAT(words({}), HasSubstr("nothing to localise"));
  EXPECT_THAT(words({.logs = {"lap.mcap"}, .robot = "ros2:limo"}), HasSubstr("lap.mcap"));
  EXPECT_THAT(words({.logs = {"v4l2:/dev/video0", "v4l2:/dev/video1"}}), HasSubstr("once for each camera"));
  EXPECT_THAT(words({.logs = {"walk.mp4", "walk2.mp4"}}), HasSubstr("walk2.mp4"));
}

}  // namespace
}  // namespace waymark
