#include "waymark/robots/dds/ros_environment.hpp"

#include <map>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

Environment of(const std::map<std::string, std::string>& values) {
  return [values](const char* name) -> std::optional<std::string> {
    const auto found = values.find(name);
    return found == values.end() ? std::nullopt : std::optional(found->second);
  };
}

TEST(RosGraph, GidHas24BytesUpToHumbleAnd16Since) {
  OwnEndpoints own{.publishers = {Guid{1, 2}, Guid{3}}, .subscriptions = {Guid{4}}};
  own.participant[15] = 0xc1;
  const auto size = [&](const char* distro) {
    const auto node = ros_node_description(distro, "waymark");
    if (!node) return std::size_t{0};
    EXPECT_EQ(node->name.topic, "ros_discovery_info");
    return node->bytes(own).size();
  };
  const std::size_t fixed = 4 + 4 + (4 + 2 + 2) + (4 + 8) + 4 + 4;  // aligned counts and names
  for (const char* old : {"foxy", "galactic", "humble"})
    EXPECT_EQ(size(old), fixed + std::size_t{4} * 24) << old;
  for (const char* since : {"iron", "jazzy", "rolling"})
    EXPECT_EQ(size(since), fixed + std::size_t{4} * 16) << since;
  const auto wrong = ros_node_description("humbel", "waymark");
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().place.key, "ros_distro");
  EXPECT_NE(to_string(wrong.error()).find("humble"), std::string::npos);
  testing::expect_on_page("robots", wrong.error());
  BusOptions options;
  EXPECT_TRUE(show_in_node_list(options, ""));
  EXPECT_FALSE(options.self) << "the wrong release crashes other programs, so there is no default";
}

TEST(RosEnvironment, AppliesTheVariablesOfRos) {
  BusOptions options;
  ASSERT_TRUE(apply_ros_environment(options, of({})));
  EXPECT_EQ(options.domain, 0);
  EXPECT_FALSE(options.localhost_only);
  ASSERT_TRUE(apply_ros_environment(options, of({{"ROS_DOMAIN_ID", "42"},
                                                 {"ROS_LOCALHOST_ONLY", "1"},
                                                 {"ROS_STATIC_PEERS", "10.0.0.2;10.0.0.3;localhost"}})));
  EXPECT_EQ(options.domain, 42);
  EXPECT_TRUE(options.localhost_only);
  EXPECT_EQ(options.peers, (std::vector<std::string>{"10.0.0.2", "10.0.0.3", "127.0.0.1"}));
  BusOptions jazzy;
  ASSERT_TRUE(apply_ros_environment(jazzy, of({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"}})));
  EXPECT_TRUE(jazzy.localhost_only);
  EXPECT_EQ(jazzy.enclave, "/");
  ASSERT_TRUE(apply_ros_environment(jazzy, of({{"ROS_SECURITY_ENABLE", "true"},
                                               {"ROS_SECURITY_KEYSTORE", "/keys"},
                                               {"ROS_SECURITY_ENCLAVE_OVERRIDE", "/lab/waymark"}})));
  EXPECT_EQ(jazzy.enclave, "/lab/waymark");
  EXPECT_EQ(jazzy.keystore, "/keys/enclaves/lab/waymark");
}

TEST(RosEnvironment, OptionsOverrideTheEnvironment) {
  const auto environment = of({{"ROS_DOMAIN_ID", "42"}});
  const auto usual = bus_options({}, "waymark", environment);
  ASSERT_TRUE(usual);
  EXPECT_EQ(usual->domain, 42);
  EXPECT_EQ(usual->node, "waymark");
  const auto named = bus_options({.domain = 7, .localhost = true}, "waymark", environment);
  ASSERT_TRUE(named);
  EXPECT_EQ(named->domain, 7);
  EXPECT_TRUE(named->localhost_only);
  const auto nowhere = bus_options({.interface = "no such interface"}, "waymark", environment);
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().place.key, "interface");
}

TEST(RosEnvironment, RejectsInvalidValues) {
  for (const auto& [name, value] :
       std::map<std::string, std::string>{{"ROS_DOMAIN_ID", "233"},
                                          {"ROS_LOCALHOST_ONLY", "yes"},
                                          {"ROS_AUTOMATIC_DISCOVERY_RANGE", "HOME"},
                                          {"ROS_SECURITY_ENCLAVE_OVERRIDE", "waymark"},
                                          {"ROS_STATIC_PEERS", "no such host"}}) {
    BusOptions options;
    const Status status = apply_ros_environment(options, of({{name, value}}));
    ASSERT_FALSE(status) << name;
    EXPECT_EQ(status.error().place.key, name);
    testing::expect_on_page("robots", status.error());
  }
  BusOptions options;
  const Status off = apply_ros_environment(options, of({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"}}));
  ASSERT_FALSE(off);
  EXPECT_EQ(off.error().place.key, "ROS_AUTOMATIC_DISCOVERY_RANGE");
  testing::expect_on_page("robots", off.error());
  const Status keyless = apply_ros_environment(options, of({{"ROS_SECURITY_ENABLE", "true"}}));
  ASSERT_FALSE(keyless);
  EXPECT_EQ(keyless.error().place.key, "ROS_SECURITY_KEYSTORE");
  testing::expect_on_page("robots", keyless.error());
  for (const char* bad : {"", "x", "-1", "1 ", "1x", "99999999999"}) {
    BusOptions other;
    EXPECT_EQ(apply_ros_environment(other, of({{"ROS_DOMAIN_ID", bad}})).has_value(), *bad == '\0') << bad;
  }
}

}  // namespace
}  // namespace waymark
