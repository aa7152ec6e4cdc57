#include "waymark/drivers/dds/discovery.hpp"

#include <array>
#include <set>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include "waymark/drivers/dds/ros_names.hpp"

namespace waymark {
namespace {

std::string topic_for_people(const BusTopic& name) {
  const auto ros = ros_topic(name);
  return ros ? ros->topic : name.topic;
}

std::string type_for_people(const BusTopic& name) {
  const auto ros = ros_topic(name);
  return ros ? ros->type : name.type;
}

const char* reliability(const TopicQos& qos) { return qos.reliable ? "reliable" : "best effort"; }
const char* durability(const TopicQos& qos) { return qos.transient_local ? "transient local" : "volatile"; }

}  // namespace

std::optional<std::string> mismatch(const TopicUse& ours, const BusEndpoint& theirs) {
  if (ours.publishes == theirs.publishes || ours.name.topic != theirs.name.topic) return std::nullopt;
  const std::string topic = topic_for_people(ours.name);
  if (ours.name.type != theirs.name.type)
    return fmt::format("{} is {} as {}, but {} is {} here", topic,
                       theirs.publishes ? "published" : "subscribed", type_for_people(theirs.name),
                       type_for_people(ours.name), theirs.publishes ? "expected" : "published");
  const TopicQos& offered = ours.publishes ? ours.qos : theirs.qos;
  const TopicQos& requested = ours.publishes ? theirs.qos : ours.qos;
  const bool unreliable = requested.reliable && !offered.reliable;
  if (!unreliable && (!requested.transient_local || offered.transient_local)) return std::nullopt;
  const char* has = unreliable ? reliability(offered) : durability(offered);
  const char* wants = unreliable ? reliability(requested) : durability(requested);
  return ours.publishes
             ? fmt::format("{} is requested {} by a subscription, but published {} here", topic, wants, has)
             : fmt::format("{} is offered {}, but requested {} here", topic, has, wants);
}

std::vector<std::string> mismatches(const std::vector<TopicUse>& ours,
                                    const std::vector<BusEndpoint>& theirs) {
  std::set<std::string> words;
  for (const TopicUse& use : ours)
    for (const BusEndpoint& endpoint : theirs)
      if (auto found = mismatch(use, endpoint)) words.insert(std::move(*found));
  return {words.begin(), words.end()};
}

std::vector<std::string> interface_addresses() {
  std::vector<std::string> addresses;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return addresses;
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET || (one->ifa_flags & IFF_UP) == 0)
      continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto* address = reinterpret_cast<const sockaddr_in*>(one->ifa_addr);
    if (inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size()) != nullptr)
      addresses.emplace_back(text.data());
  }
  freeifaddrs(list);
  return addresses;
}

std::string searched(const BusOptions& options, const Bus& bus) {
  std::vector<std::string> where = options.interfaces;
  if (options.localhost_only) where = {"127.0.0.1"};
  if (where.empty()) where = interface_addresses();
  std::string words = fmt::format("domain {} on {}", options.domain, fmt::join(where, ", "));
  if (!options.peers.empty()) words += fmt::format(" and at {}", fmt::join(options.peers, ", "));
  const std::vector<std::string> others = bus.participants();
  if (others.empty()) return words + ": no other participant";
  std::set<std::string> topics;
  for (const BusEndpoint& endpoint : bus.endpoints())
    if (const auto ros = ros_topic(endpoint.name)) topics.insert(ros->topic);
  constexpr std::size_t kMostNamed = 12;
  const std::size_t named = std::min(topics.size(), kMostNamed);
  words += fmt::format(": {} other participant{}, {} topic{}", others.size(), others.size() == 1 ? "" : "s",
                       topics.size(), topics.size() == 1 ? "" : "s");
  if (named > 0)
    words += fmt::format(" ({}{})",
                         fmt::join(topics.begin(), std::next(topics.begin(), static_cast<long>(named)), ", "),
                         topics.size() > named ? ", …" : "");
  return words;
}

}  // namespace waymark
