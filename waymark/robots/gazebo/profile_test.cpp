#include "waymark/robots/gazebo/profile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

TEST(GazeboProfile, TheOneThatComesWithWaymarkNamesEveryTopicOnce) {
  const auto profile = find_gazebo_profile("limo");
  ASSERT_TRUE(profile) << to_string(profile.error());
  EXPECT_EQ(subscriptions_of(*profile).size(), 8U);
  EXPECT_TRUE(find_shared("robots", profile->robot));
}

TEST(GazeboProfile, FindsTheRobotBesideIt) {
  const auto folder = testing::fresh_folder("gazebo_profile");
  ASSERT_TRUE(write_text_file(folder / "robot.yaml", "robot: {}\n"));
  ASSERT_TRUE(write_text_file(folder / "gazebo.yaml", "robot: robot.yaml\nodometry_topic: /odom\n"));
  const auto profile = find_gazebo_profile((folder / "gazebo.yaml").string());
  ASSERT_TRUE(profile) << to_string(profile.error());
  EXPECT_EQ(profile->robot, (folder / "robot.yaml").string()) << "from whatever folder it is read";
}

TEST(GazeboProfile, SaysWhatIsWrong) {
  const auto error = [](const char* text) {
    const auto profile = parse_gazebo_profile(text, "my.yaml");
    return profile ? std::string("none") : to_string(profile.error());
  };
  EXPECT_NE(error("odometry_topic: ''\n").find("odometry_topic"), std::string::npos);
  EXPECT_NE(error("command_topic: ''\n").find("command_topic"), std::string::npos);
  EXPECT_NE(error("odom_topic: /odom\n").find("odometry_topic"), std::string::npos) << "the nearest key";
  EXPECT_NE(error("imu_topic: /a\nscan_topic: /a\n").find("/a is named twice"), std::string::npos);
  EXPECT_NE(error("").find("this profile is empty"), std::string::npos);
  EXPECT_FALSE(find_gazebo_profile("limmo"));
}

}  // namespace
}  // namespace waymark
