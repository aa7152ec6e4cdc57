#include <algorithm>
#include <array>
#include <map>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "waymark/robots/dds/discovery.hpp"
#include "waymark/robots/dds/ros_environment.hpp"
#include "waymark/robots/dds/ros_graph.hpp"
#include "waymark/robots/dds/ros_names.hpp"

namespace waymark {
namespace {

Environment of(const std::map<std::string, std::string>& values) {
  return [values](const char* name) -> std::optional<std::string> {
    const auto found = values.find(name);
    return found == values.end() ? std::nullopt : std::optional(found->second);
  };
}

TEST(RosNames, MapToDdsAndBack) {
  const BusTopic odom = dds_topic("/odom", "nav_msgs/msg/Odometry");
  EXPECT_EQ(odom.topic, "rt/odom");
  EXPECT_EQ(odom.type, "nav_msgs::msg::dds_::Odometry_");
  const auto back = ros_topic(dds_topic("/camera/color/image_raw", "sensor_msgs/msg/Image"));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->topic, "/camera/color/image_raw");
  EXPECT_EQ(back->type, "sensor_msgs/msg/Image");
  EXPECT_EQ(dds_topic("odom", "a/msg/B").topic, "rt/odom") << "with and without the slash";
  const ServiceTopics stop = dds_service("/waymark/stop", "std_srvs/srv/Trigger");
  EXPECT_EQ(stop.request.topic, "rq/waymark/stopRequest");
  EXPECT_EQ(stop.request.type, "std_srvs::srv::dds_::Trigger_Request_");
  EXPECT_EQ(stop.reply.topic, "rr/waymark/stopReply");
  EXPECT_EQ(stop.reply.type, "std_srvs::srv::dds_::Trigger_Response_");
  for (const BusTopic& none :
       {BusTopic{"ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"},
        BusTopic{"rt/x", "Square"}, stop.request, BusTopic{}})
    EXPECT_FALSE(ros_topic(none)) << none.topic;
}

TEST(RosNames, TopicsAreThoseThatRosTakes) {
  for (const char* right : {"/odom", "odom", "/r1/camera_2/image_raw", "_a", "/a/_2"})
    EXPECT_TRUE(is_topic_name(right)) << right;
  for (const char* wrong : {"", "/", "/a b", "//a", "/a/", "/a//b", "/2a", "/a/2b", "/a-b", "/\xc3\xa9"})
    EXPECT_FALSE(is_topic_name(wrong)) << wrong;
}

TEST(RosGraph, IdentitiesHave24BytesUpToHumbleAnd16Since) {
  OwnEndpoints own{.publishers = {Guid{1, 2}, Guid{3}}, .subscriptions = {Guid{4}}};
  own.participant[15] = 0xc1;
  const auto size = [&](const char* distro) {
    const auto node = ros_node_description(distro, "waymark");
    if (!node) return std::size_t{0};
    EXPECT_EQ(node->name.topic, "ros_discovery_info");
    return node->bytes(own).size();
  };
  const std::size_t fixed = 4 + 4 + (4 + 2 + 2) + (4 + 8) + 4 + 4;  // counts and names, as they are aligned
  for (const char* old : {"foxy", "galactic", "humble"})
    EXPECT_EQ(size(old), fixed + std::size_t{4} * 24) << old;
  for (const char* since : {"iron", "jazzy", "rolling"})
    EXPECT_EQ(size(since), fixed + std::size_t{4} * 16) << since;
  const auto wrong = ros_node_description("humbel", "waymark");
  ASSERT_FALSE(wrong);
  EXPECT_NE(to_string(wrong.error()).find("humble"), std::string::npos);
  BusOptions options;
  EXPECT_TRUE(show_in_node_list(options, ""));
  EXPECT_FALSE(options.self) << "a wrong release crashes others: only where it is named";
}

TEST(RosEnvironment, IsReadAsRosReadsIt) {
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

TEST(RosEnvironment, APlaceThatIsNamedGoesBeforeIt) {
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
  EXPECT_EQ(nowhere.error().place.key, "--interface");
}

TEST(RosEnvironment, RefusesWhatMakesNoSense) {
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
  }
  BusOptions options;
  const Status off = apply_ros_environment(options, of({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"}}));
  ASSERT_FALSE(off);
  EXPECT_NE(off.error().message.find("switches discovery off"), std::string::npos);
  const Status keyless = apply_ros_environment(options, of({{"ROS_SECURITY_ENABLE", "true"}}));
  ASSERT_FALSE(keyless);
  EXPECT_EQ(keyless.error().place.key, "ROS_SECURITY_KEYSTORE");
  for (const char* bad : {"", "x", "-1", "1 ", "1x", "99999999999"}) {
    BusOptions options;
    EXPECT_EQ(apply_ros_environment(options, of({{"ROS_DOMAIN_ID", bad}})).has_value(), *bad == '\0') << bad;
  }
}

TEST(Mismatch, FollowsTheTableOfRequestedAndOffered) {
  const BusTopic scan = dds_topic("/scan", "sensor_msgs/msg/LaserScan");
  for (const bool offered_reliable : {false, true})
    for (const bool offered_local : {false, true})
      for (const bool asked_reliable : {false, true})
        for (const bool asked_local : {false, true}) {
          const TopicQos offered{.reliable = offered_reliable, .transient_local = offered_local};
          const TopicQos asked{.reliable = asked_reliable, .transient_local = asked_local};
          const bool fits = (offered_reliable || !asked_reliable) && (offered_local || !asked_local);
          EXPECT_EQ(!mismatch({false, scan, asked}, {true, scan, offered, {}}), fits);
          EXPECT_EQ(!mismatch({true, scan, offered}, {false, scan, asked, {}}), fits);
        }
}

TEST(Mismatch, IsSaidInWords) {
  const BusTopic scan = dds_topic("/scan", "sensor_msgs/msg/LaserScan");
  const BusTopic other = dds_topic("/scan", "sensor_msgs/msg/Image");
  const TopicQos best_effort{.reliable = false};
  EXPECT_EQ(mismatch({false, scan, {}}, {true, scan, best_effort, {}}).value_or(""),
            "/scan is offered best effort, but requested reliable here");
  EXPECT_EQ(mismatch({false, scan, {.transient_local = true}}, {true, scan, {}, {}}).value_or(""),
            "/scan is offered volatile, but requested transient local here");
  EXPECT_EQ(mismatch({false, scan, {}}, {true, other, {}, {}}).value_or(""),
            "/scan is published as sensor_msgs/msg/Image, but sensor_msgs/msg/LaserScan is expected here");
  EXPECT_FALSE(mismatch({false, scan, {}}, {false, scan, best_effort, {}})) << "both subscribe";
  EXPECT_FALSE(mismatch({false, scan, {}}, {true, dds_topic("/odom", "a/msg/B"), best_effort, {}}));
  EXPECT_EQ(
      mismatches({{false, scan, {}}}, {{true, scan, best_effort, {}}, {true, scan, best_effort, {}}}).size(),
      1U)
      << "each is said once";
}

/// What a bus has discovered, and nothing else.
class FoundBus final : public Bus {
 public:
  std::vector<std::string> others{};
  std::vector<BusEndpoint> found{};

  Result<std::size_t> advertise(const BusTopic&, const TopicQos&) override { return std::size_t{0}; }
  Result<std::size_t> subscribe(const BusTopic&, const TopicQos&) override { return std::size_t{0}; }
  void unsubscribe(std::size_t) override {}
  Status publish(std::size_t, std::span<const std::uint8_t>) override { return {}; }
  Status reply(std::size_t, std::span<const std::uint8_t>, const RequestIdentity&) override { return {}; }
  std::optional<BusMessage> next(Duration) override { return std::nullopt; }
  [[nodiscard]] bool more() const override { return false; }
  [[nodiscard]] int matched_subscriptions(std::size_t) const override { return 0; }
  [[nodiscard]] int matched_publishers(std::size_t) const override { return 0; }
  [[nodiscard]] std::uint64_t dropped(std::size_t) const override { return 0; }
  [[nodiscard]] std::vector<BusEndpoint> endpoints() const override { return found; }
  [[nodiscard]] std::vector<std::string> participants() const override { return others; }
  [[nodiscard]] std::string participant_of(const Guid&) const override { return {}; }
};

TEST(Searched, SaysWhereItWasLookedAndWhatIsThere) {
  FoundBus bus;
  EXPECT_EQ(searched({.domain = 3, .localhost_only = true}, bus),
            "domain 3 on 127.0.0.1: no other participant");
  EXPECT_EQ(searched({.interfaces = {"10.0.0.2"}, .peers = {"10.0.0.9"}}, bus),
            "domain 0 on 10.0.0.2 and at 10.0.0.9: no other participant");
  bus.others = {"/robot"};
  bus.found = {{true, dds_topic("/odom", "a/msg/B"), {}, {}},
               {false, dds_topic("/odom", "a/msg/B"), {}, {}},
               {true, {"rq/startRequest", "x"}, {}, {}}};
  EXPECT_EQ(searched({.localhost_only = true}, bus),
            "domain 0 on 127.0.0.1: 1 other participant, 1 topic (/odom)")
      << "a topic once, and no service";
  bus.found.clear();
  EXPECT_NE(searched({}, bus).find(
                "1 other participant, 0 topics; it has none or is restricted to its own machine"),
            std::string::npos)
      << "one with --localhost is discovered, but none of its topics";
  bus.others.emplace_back("/another");
  for (int i = 10; i < 30; ++i)
    bus.found.push_back({true, dds_topic("/a" + std::to_string(i), "a/msg/B"), {}, {}});
  const std::string words = searched({.localhost_only = true}, bus);
  EXPECT_NE(words.find("2 other participants, 20 topics (/a10, "), std::string::npos) << words;
  EXPECT_NE(words.find("/a21, …)"), std::string::npos) << words;
}

/// The program that runs this test, as a participant of DDS is called.
std::string own_participant() {
  std::array<char, 65> host{};
  EXPECT_EQ(gethostname(host.data(), host.size() - 1), 0);
  return "waymark (process " + std::to_string(getppid()) + " on " + host.data() + ")";
}

TEST(Searched, LeavesOutTheProgramThatThisProcessWasStartedBy) {
  FoundBus bus;
  bus.others = {own_participant()};
  EXPECT_TRUE(is_own_family(bus.others[0]));
  EXPECT_FALSE(is_own_family("waymark (process " + std::to_string(getpid()) + " on elsewhere)"));
  EXPECT_EQ(searched({.localhost_only = true}, bus), "domain 0 on 127.0.0.1: no other participant");
}

TEST(Searched, SaysHowProgramsOfThisMachineAloneAreFound) {
  const std::string words = searched({}, FoundBus());
  EXPECT_NE(words.find("programs restricted to this machine are found with --localhost"), std::string::npos)
      << words;
}

TEST(UseInterface, TakesAddressOrNameOfOneThatIsThere) {
  for (const char* right : {"127.0.0.1", "lo"}) {
    BusOptions options{.interfaces = {"10.9.8.7"}};
    const Status status = use_interface(options, right);
    ASSERT_TRUE(status) << to_string(status.error());
    EXPECT_EQ(options.interfaces, (std::vector<std::string>{"127.0.0.1"}));
  }
  BusOptions options;
  const Status none = use_interface(options, "203.0.113.9");
  ASSERT_FALSE(none);
  EXPECT_NE(to_string(none.error()).find("127.0.0.1 (lo)"), std::string::npos) << to_string(none.error());
}

TEST(InterfaceAddresses, AreIPv4OfThisMachine) {
  for (const std::string& address : interface_addresses())
    EXPECT_EQ(std::count(address.begin(), address.end(), '.'), 3) << address;
}

}  // namespace
}  // namespace waymark
