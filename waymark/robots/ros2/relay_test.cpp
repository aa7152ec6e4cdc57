#include "waymark/robots/ros2/relay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/robots/dds/ros_names.hpp"

namespace waymark {
namespace {

TEST(Relay, ReportsWhatPreventsCommandsFromReachingTheRobot) {
  const auto topic = [](const char* name, const char* type) { return dds_topic(name, type); };
  const TopicUse from{.name = topic("/teleop", "geometry_msgs/msg/Twist"), .qos = {.reliable = false}};
  const TopicUse to{.publishes = true, .name = topic("/cmd_vel", "geometry_msgs/msg/Twist")};
  const BusEndpoint driver{true, from.name, {}, Guid{1}};
  const BusEndpoint robot{false, to.name, {}, Guid{2}};
  EXPECT_TRUE(relay_problems(from, to, {driver, robot}).empty());
  const auto unconnected = relay_problems(from, to, {});
  ASSERT_EQ(unconnected.size(), 2U);
  EXPECT_NE(unconnected[0].find("/teleop"), std::string::npos);
  EXPECT_NE(unconnected[1].find("/cmd_vel"), std::string::npos);
  for (const std::string& problem : unconnected) testing::expect_on_page("robots", problem);
  const BusEndpoint stamped{true, topic("/teleop", "geometry_msgs/msg/TwistStamped"), {}, Guid{3}};
  const auto other_type = relay_problems(from, to, {stamped, robot});
  ASSERT_EQ(other_type.size(), 1U);
  EXPECT_NE(other_type[0].find("geometry_msgs/msg/TwistStamped"), std::string::npos);
  testing::expect_on_page("robots", other_type[0]);
  const BusEndpoint bypass{true, to.name, {}, Guid{4}};
  const auto bypassed = relay_problems(from, to, {driver, robot, bypass});
  ASSERT_EQ(bypassed.size(), 1U);
  EXPECT_NE(bypassed[0].find("/cmd_vel"), std::string::npos);
  testing::expect_on_page("robots", bypassed[0]);
  for (const std::string& text : {relay_start_text({}, 0), relay_end_text({.received = 7, .ceased = 1})})
    testing::expect_on_page("robots", text);
}

}  // namespace
}  // namespace waymark
