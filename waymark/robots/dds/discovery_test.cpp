#include "waymark/robots/dds/discovery.hpp"

#include <algorithm>
#include <array>
#include <string>

#include <unistd.h>

#include <gtest/gtest.h>

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
      << "one with `localhost` is discovered, but none of its topics";
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
  EXPECT_NE(words.find("programs restricted to this machine are found with `localhost`"), std::string::npos)
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
