#include "waymark/robots/ros2/profile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/robots/dds/ros_environment.hpp"
#include "waymark/robots/dds/ros_names.hpp"

namespace waymark {
namespace {

TEST(Ros2Profile, ReadsTheInstalledProfiles) {
  for (const char* name :
       {"limo", "turtlebot3", "turtlebot3-waffle-pi", "turtlebot3-burger", "limo-sim", "limo-sim-tags"}) {
    const auto profile = find_ros2_profile(name);
    ASSERT_TRUE(profile) << to_string(profile.error());
    const auto uses = uses_of(*profile);
    EXPECT_GE(uses.size(), 4U);
    EXPECT_TRUE(uses.front().publishes);
    EXPECT_TRUE(uses.front().qos.reliable) << "nodes may request reliable commands";
  }
  EXPECT_EQ(command_use(find_ros2_profile("turtlebot3").value()).name.type,
            "geometry_msgs::msg::dds_::TwistStamped_");
}

TEST(Ros2Profile, RejectsInvalidProfiles) {
  const auto error = [](const char* text) {
    const Error found = parse_ros2_profile(text, "my.yaml").error();
    testing::expect_on_page("robots", found);
    return to_string(found);
  };
  EXPECT_NE(error("odometry_topic: ''\n").find("odometry_topic"), std::string::npos);
  EXPECT_NE(error("command_topic: ''\n").find("command_topic"), std::string::npos);
  EXPECT_NE(error("odom_topic: /odom\n").find("odometry_topic"), std::string::npos)
      << "suggests the nearest key";
  EXPECT_NE(error("image_topic: /a\ncompressed_image_topic: /b\n").find("(image_topic)"), std::string::npos);
  EXPECT_NE(error("odometry_topic: /my odom\n").find("'/my odom'"), std::string::npos);
  EXPECT_NE(error("imu_topic: /odom\n").find("'/odom'"), std::string::npos);
  EXPECT_NE(error("imu_topic: odom\n").find("'odom'"), std::string::npos) << "leading slash is optional";
  EXPECT_EQ(error(""), error("# my robot\n")) << "an empty profile";
  EXPECT_NE(error("- limo\n- /odom\n"), error("")) << "a list is not an empty profile";
  EXPECT_FALSE(find_ros2_profile("limmo"));
  const auto nameless = find_ros2_profile("");
  ASSERT_FALSE(nameless);
  EXPECT_EQ(nameless.error().place.key, "profile");
  testing::expect_on_page("robots", nameless.error());
}

TEST(Ros2Profile, UsesItsInterfaceUnlessAlreadyRestricted) {
  BusOptions options;
  ASSERT_TRUE(use_interface_of({.interface = "lo"}, options));
  EXPECT_EQ(options.interfaces, (std::vector<std::string>{"127.0.0.1"}));
  BusOptions local{.localhost_only = true};
  EXPECT_TRUE(use_interface_of({.interface = "203.0.113.9"}, local)) << "not used";
  BusOptions all;
  EXPECT_FALSE(use_interface_of({.interface = "203.0.113.9"}, all));
}

TEST(Ros2Profile, ReportsRequiredTopicsWithoutPublisher) {
  const auto published = [](const char* topic, std::string_view type) {
    return BusEndpoint{.publishes = true, .name = dds_topic(topic, type)};
  };
  const Ros2Profile images{.image_topic = "/image"};
  EXPECT_THAT(missing_publishers(images, {}), ::testing::ElementsAre(::testing::HasSubstr("/image")));
  EXPECT_TRUE(missing_publishers(images, {published("/image", ros2::Image::kType)}).empty());
  EXPECT_TRUE(
      missing_publishers(images, {published("/image/compressed", ros2::CompressedImage::kType)}).empty());
  BusEndpoint wanted = published("/image", ros2::Image::kType);
  wanted.publishes = false;
  EXPECT_EQ(missing_publishers(images, {wanted}).size(), 1U) << "a subscription is not a publisher";
  const Ros2Profile simulated{.use_sim_time = true};
  EXPECT_THAT(missing_publishers(simulated, {}), ::testing::ElementsAre(::testing::HasSubstr("/clock")));
  EXPECT_TRUE(missing_publishers(simulated, {published("/clock", "rosgraph_msgs/msg/Clock")}).empty());
}

TEST(Ros2Profile, SensorsAreBestEffortAndTfStaticIsKept) {
  Ros2Profile profile;
  profile.image_topic = "/image";
  for (const Ros2Subscription& one : subscriptions_of(profile)) {  // /tf changes, so messages are not kept
    const bool fixed = one.topic == "/tf_static";
    EXPECT_EQ(one.qos.reliable, fixed) << one.topic;
    EXPECT_EQ(one.qos.transient_local, fixed) << one.topic;
  }
}

}  // namespace
}  // namespace waymark
