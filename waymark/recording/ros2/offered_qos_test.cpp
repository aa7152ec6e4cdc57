// QoS profiles as rosbag2 stores them, in both notations.
#include "waymark/recording/ros2/offered_qos.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

// From ros2/rosbag2, rosbag2_py/test/resources/mcap/talker/metadata.yaml.
constexpr const char* kTalker =
    "- history: 3\n  depth: 0\n  reliability: 1\n  durability: 2\n  deadline:\n    sec: 0\n    nsec: 0\n"
    "  lifespan:\n    sec: 10\n    nsec: 5\n  liveliness: 1\n  liveliness_lease_duration:\n    sec: 0\n"
    "    nsec: 0\n  avoid_ros_namespace_conventions: false\n";

TEST(OfferedQos, AProfileRoundTrips) {
  EXPECT_EQ(to_yaml(parse_offered_qos(kTalker), QosNotation::Numbers), kTalker);
}

TEST(OfferedQos, BothNotationsAndYamlStylesAreEquivalent) {
  const auto by_names = to_yaml(parse_offered_qos(kTalker), QosNotation::Names);
  EXPECT_THAT(by_names, ::testing::HasSubstr("- history: unknown\n  depth: 0\n  reliability: reliable\n"));
  EXPECT_EQ(to_yaml(parse_offered_qos(by_names), QosNotation::Numbers), kTalker);
  const auto flow = parse_offered_qos(
      "[{history: KEEP_LAST, depth: 5, reliability: best_effort, durability: transient_local, deadline: "
      "{sec: "
      "1, nsec: 2}, liveliness: manual_by_topic, avoid_ros_namespace_conventions: true}]");
  ASSERT_EQ(flow.size(), 1U);
  EXPECT_EQ(flow[0].history, 1);
  EXPECT_EQ(flow[0].depth, 5U);
  EXPECT_EQ(flow[0].reliability, 2);
  EXPECT_EQ(flow[0].durability, 1);
  EXPECT_EQ(flow[0].deadline.sec, 1U);
  EXPECT_EQ(flow[0].deadline.nsec, 2U);
  EXPECT_EQ(flow[0].lifespan.sec, QosTime{}.sec);
  EXPECT_EQ(flow[0].liveliness, 3);
  EXPECT_TRUE(flow[0].avoid_ros_namespace_conventions);
}

TEST(OfferedQos, KeepsSeveralProfilesSeparate) {
  const auto two = parse_offered_qos(std::string(kTalker) + "- history: 1\n  depth: 7\n");
  ASSERT_EQ(two.size(), 2U);
  EXPECT_EQ(two[0].depth, 0U);
  EXPECT_EQ(two[1].depth, 7U);
  EXPECT_EQ(parse_offered_qos(to_yaml(two, QosNotation::Names, 4)).size(), 2U);
}

TEST(OfferedQos, TextWithoutProfilesGivesNone) {
  for (const char* text : {"", "[]", "- depth: 3", "history", ":::", "history history"})
    EXPECT_LE(parse_offered_qos(text).size(), 2U) << text;
  EXPECT_EQ(to_yaml({}, QosNotation::Names, 2), "  []\n");
  const auto odd = parse_offered_qos("- history: 99\n  depth: many\n  reliability: -1\n");
  ASSERT_EQ(odd.size(), 1U);
  EXPECT_EQ(odd[0].history, OfferedQos{}.history);
  EXPECT_EQ(odd[0].depth, OfferedQos{}.depth);
}

}  // namespace
}  // namespace waymark
