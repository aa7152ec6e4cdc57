#include "waymark/robots/dds/discovery.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string>

#include <unistd.h>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/robots/dds/ros_names.hpp"

namespace waymark {
namespace {

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

TEST(Mismatch, ReportsTopicTypesAndQos) {
  const BusTopic scan = dds_topic("/scan", "sensor_msgs/msg/LaserScan");
  const BusTopic other = dds_topic("/scan", "sensor_msgs/msg/Image");
  const TopicQos best_effort{.reliable = false};
  testing::expect_on_page("robots", mismatch({false, scan, {}}, {true, scan, best_effort, {}}).value_or(""));
  testing::expect_on_page(
      "robots", mismatch({false, scan, {.transient_local = true}}, {true, scan, {}, {}}).value_or(""));
  const std::string types = mismatch({false, scan, {}}, {true, other, {}, {}}).value_or("");
  testing::expect_on_page("robots", types);
  for (const char* part : {"/scan", "sensor_msgs/msg/Image", "sensor_msgs/msg/LaserScan"})
    EXPECT_NE(types.find(part), std::string::npos) << types;
  EXPECT_FALSE(mismatch({false, scan, {}}, {false, scan, best_effort, {}})) << "both subscribe";
  EXPECT_FALSE(mismatch({false, scan, {}}, {true, dds_topic("/odom", "a/msg/B"), best_effort, {}}));
  EXPECT_EQ(
      mismatches({{false, scan, {}}}, {{true, scan, best_effort, {}}, {true, scan, best_effort, {}}}).size(),
      1U)
      << "without duplicates";
}

/// A bus that returns fixed discovery results and does nothing else.
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

TEST(Searched, ReportsDomainAddressesParticipantsAndTopics) {
  FoundBus bus;
  const auto expect_parts = [](const std::string& text, std::initializer_list<const char*> parts) {
    testing::expect_on_page("robots", text);
    for (const char* part : parts) EXPECT_NE(text.find(part), std::string::npos) << part << " in " << text;
  };
  expect_parts(searched({.domain = 3, .localhost_only = true}, bus), {"domain 3", "127.0.0.1"});
  expect_parts(searched({.interfaces = {"10.0.0.2"}, .peers = {"10.0.0.9"}}, bus),
               {"domain 0", "10.0.0.2", "10.0.0.9"});
  bus.others = {"/robot"};
  bus.found = {{true, dds_topic("/odom", "a/msg/B"), {}, {}},
               {false, dds_topic("/odom", "a/msg/B"), {}, {}},
               {true, {"rq/startRequest", "x"}, {}, {}}};
  const std::string once =
      searched({.localhost_only = true}, bus);  // duplicates and services are not counted
  expect_parts(once, {"1 other participant", "1 topic (/odom)"});
  bus.found.clear();
  // A program with `localhost` is discovered without its topics.
  expect_parts(searched({.interfaces = {"10.0.0.2"}}, bus),
               {"0 topics", "`localhost`", "ROS_LOCALHOST_ONLY"});
  bus.others.emplace_back("/another");
  for (int i = 10; i < 30; ++i)
    bus.found.push_back({true, dds_topic("/a" + std::to_string(i), "a/msg/B"), {}, {}});
  expect_parts(searched({.localhost_only = true}, bus),
               {"2 other participants", "20 topics (/a10, ", "/a21, …)"});
}

/// The DDS participant name of the program running this test.
std::string own_participant() {
  std::array<char, 65> host{};
  EXPECT_EQ(gethostname(host.data(), host.size() - 1), 0);
  return "waymark (process " + std::to_string(getppid()) + " on " + host.data() + ")";
}

TEST(Searched, SkipsAncestorsOfThisProcess) {
  FoundBus bus;
  bus.others = {own_participant()};
  EXPECT_TRUE(is_own_family(bus.others[0]));
  EXPECT_FALSE(is_own_family("waymark (process " + std::to_string(getpid()) + " on elsewhere)"));
  EXPECT_EQ(searched({.localhost_only = true}, bus), searched({.localhost_only = true}, FoundBus()));
}

TEST(Searched, SuggestsLocalhostIfNoParticipantIsFound) {
  const std::string text = searched({}, FoundBus());
  EXPECT_NE(text.find("`localhost` or ROS_LOCALHOST_ONLY=1"), std::string::npos) << text;
}

TEST(UseInterface, AcceptsAddressOrNameOfAnAvailableInterface) {
  for (const char* right : {"127.0.0.1", "lo"}) {
    BusOptions options{.interfaces = {"10.9.8.7"}};
    const Status status = use_interface(options, right);
    ASSERT_TRUE(status) << to_string(status.error());
    EXPECT_EQ(options.interfaces, (std::vector<std::string>{"127.0.0.1"}));
  }
  BusOptions options;
  const Status none = use_interface(options, "203.0.113.9");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(none.error().place.key, "interface");
  EXPECT_NE(none.error().message.find("203.0.113.9"), std::string::npos) << none.error().message;
  EXPECT_NE(none.error().hint.find("127.0.0.1 (lo)"), std::string::npos) << none.error().hint;
}

TEST(InterfaceAddresses, AreIPv4OfThisMachine) {
  for (const std::string& address : interface_addresses())
    EXPECT_EQ(std::count(address.begin(), address.end(), '.'), 3) << address;
}

}  // namespace
}  // namespace waymark
