#include "waymark/robots/gazebo/profile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

TEST(GazeboProfile, TheInstalledProfileHasEveryTopicOnce) {
  const auto profile = find_gazebo_profile("limo");
  ASSERT_TRUE(profile) << to_string(profile.error());
  EXPECT_EQ(subscriptions_of(*profile).size(), 8U);
  EXPECT_TRUE(find_shared("robots", profile->robot));
}

TEST(GazeboProfile, FindsTheRobotFileInItsOwnFolder) {
  const auto folder = testing::fresh_folder("gazebo_profile");
  ASSERT_TRUE(write_text_file(folder / "robot.yaml", "robot: {}\n"));
  ASSERT_TRUE(write_text_file(folder / "gazebo.yaml", "robot: robot.yaml\nodometry_topic: /odom\n"));
  const auto profile = find_gazebo_profile((folder / "gazebo.yaml").string());
  ASSERT_TRUE(profile) << to_string(profile.error());
  EXPECT_EQ(profile->robot, (folder / "robot.yaml").string()) << "independent of the working directory";
}

TEST(GazeboProfile, RejectsInvalidProfiles) {
  const auto error = [](const char* text) {
    const auto profile = parse_gazebo_profile(text, "my.yaml");
    if (profile) return std::string("none");
    testing::expect_on_page("robots", profile.error());
    return to_string(profile.error());
  };
  EXPECT_NE(error("odometry_topic: ''\n").find("odometry_topic"), std::string::npos);
  EXPECT_NE(error("command_topic: ''\n").find("command_topic"), std::string::npos);
  EXPECT_NE(error("odom_topic: /odom\n").find("odometry_topic"), std::string::npos)
      << "suggests the nearest key";
  EXPECT_NE(error("imu_topic: /a\nscan_topic: /a\n").find("/a"), std::string::npos);
  EXPECT_NE(error("").find("my.yaml"), std::string::npos);
  EXPECT_FALSE(find_gazebo_profile("limmo"));
}

}  // namespace
}  // namespace waymark
