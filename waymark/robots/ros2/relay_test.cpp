#include "waymark/robots/ros2/relay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/robots/dds/ros_names.hpp"

namespace waymark {
namespace {

TEST(Relay, SaysWhatKeepsCommandsFromTheRobot) {
  const auto topic = [](const char* name, const char* type) { return dds_topic(name, type); };
  const TopicUse from{.name = topic("/teleop", "geometry_msgs/msg/Twist"), .qos = {.reliable = false}};
  const TopicUse to{.publishes = true, .name = topic("/cmd_vel", "geometry_msgs/msg/Twist")};
  const BusEndpoint driver{true, from.name, {}, Guid{1}};
  const BusEndpoint robot{false, to.name, {}, Guid{2}};
  EXPECT_TRUE(relay_problems(from, to, {driver, robot}).empty());
  const auto nobody = relay_problems(from, to, {});
  ASSERT_EQ(nobody.size(), 2U);
  EXPECT_NE(nobody[0].find("nobody publishes /teleop yet"), std::string::npos);
  EXPECT_NE(nobody[1].find("nobody subscribes to /cmd_vel yet"), std::string::npos);
  const BusEndpoint stamped{true, topic("/teleop", "geometry_msgs/msg/TwistStamped"), {}, Guid{3}};
  const auto other_type = relay_problems(from, to, {stamped, robot});
  ASSERT_EQ(other_type.size(), 1U);
  EXPECT_NE(other_type[0].find("/teleop is published as geometry_msgs/msg/TwistStamped"), std::string::npos);
  const BusEndpoint past{true, to.name, {}, Guid{4}};
  const auto beside = relay_problems(from, to, {driver, robot, past});
  ASSERT_EQ(beside.size(), 1U);
  EXPECT_NE(beside[0].find("another program publishes /cmd_vel too"), std::string::npos);
}

}  // namespace
}  // namespace waymark
