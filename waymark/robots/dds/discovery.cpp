#include "waymark/robots/dds/discovery.hpp"

#include <array>
#include <fstream>
#include <set>
#include <sstream>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/message_text.hpp"
#include "waymark/robots/dds/ros_names.hpp"

namespace waymark {
namespace {

std::string display_topic(const BusTopic& name) {
  const auto ros = ros_topic(name);
  return ros ? ros->topic : name.topic;
}

std::string display_type(const BusTopic& name) {
  const auto ros = ros_topic(name);
  return ros ? ros->type : name.type;
}

const char* reliability(const TopicQos& qos) { return qos.reliable ? "reliable" : "best effort"; }
const char* durability(const TopicQos& qos) { return qos.transient_local ? "transient local" : "volatile"; }

}  // namespace

std::optional<std::string> mismatch(const TopicUse& ours, const BusEndpoint& theirs) {
  if (ours.publishes == theirs.publishes || ours.name.topic != theirs.name.topic) return std::nullopt;
  const std::string topic = display_topic(ours.name);
  if (ours.name.type != theirs.name.type)
    return fmt::format("{} is {} as {}, but {} is {} here", topic,
                       theirs.publishes ? "published" : "subscribed", display_type(theirs.name),
                       display_type(ours.name), theirs.publishes ? "expected" : "published");
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
  std::set<std::string> reasons;
  for (const TopicUse& use : ours)
    for (const BusEndpoint& endpoint : theirs)
      if (auto found = mismatch(use, endpoint)) reasons.insert(std::move(*found));
  return {reasons.begin(), reasons.end()};
}

namespace {

struct Interface {
  std::string name{};
  std::string address{};
};

std::vector<Interface> interfaces_up() {
  std::vector<Interface> found;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return found;
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET || (one->ifa_flags & IFF_UP) == 0)
      continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto* address = reinterpret_cast<const sockaddr_in*>(one->ifa_addr);
    if (inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size()) != nullptr)
      found.push_back({one->ifa_name, text.data()});
  }
  freeifaddrs(list);
  return found;
}

constexpr const char* kOnlyHere =
    "; programs restricted to this machine are found with `localhost` or ROS_LOCALHOST_ONLY=1";
/// Such a program may be discovered without its topics.
constexpr const char* kNoTopics =
    "; it has none, is restricted to its own machine (`localhost`, ROS_LOCALHOST_ONLY), or is behind a "
    "firewall";

/// The parent of a process, from /proc; 0 if unknown.
pid_t parent_of(pid_t process) {
  std::ifstream file(fmt::format("/proc/{}/stat", process));
  std::string text;
  std::getline(file, text);
  const std::size_t name_end = text.rfind(')');  // the program name may itself contain parentheses
  if (name_end == std::string::npos) return 0;
  std::istringstream rest(text.substr(name_end + 1));
  char state = 0;
  pid_t parent = 0;
  rest >> state >> parent;
  return parent;
}

}  // namespace

std::vector<std::string> interface_addresses() {
  std::vector<std::string> addresses;
  for (Interface& one : interfaces_up()) addresses.push_back(std::move(one.address));
  return addresses;
}

Status use_interface(BusOptions& options, const std::string& interface) {
  std::vector<std::string> available;
  options.interfaces.clear();
  for (const Interface& one : interfaces_up()) {
    if (one.address == interface || one.name == interface) options.interfaces.push_back(one.address);
    available.push_back(fmt::format("{} ({})", one.address, one.name));
  }
  if (!options.interfaces.empty()) return {};
  return fail(ErrorCode::InvalidArgument, fmt::format("no network interface '{}' is up", interface),
              {.key = "interface"}, fmt::format("Available: {}.", fmt::join(available, ", ")));
}

bool is_own_family(const std::string& participant) {
  std::array<char, 65> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) return false;
  constexpr int kMaxGenerations = 8;  // the robot's process, its watchdog and the program
  pid_t process = getpid();
  for (int i = 0; i < kMaxGenerations && process > 1; ++i, process = parent_of(process))
    if (participant.ends_with(fmt::format("(process {} on {})", process, host.data()))) return true;
  return false;
}

std::string searched(const BusOptions& options, const Bus& bus) {
  std::vector<std::string> where = options.interfaces;
  if (options.localhost_only) where = {"127.0.0.1"};
  if (where.empty()) where = interface_addresses();
  std::string text = fmt::format("domain {} on {}", options.domain, fmt::join(where, ", "));
  if (!options.peers.empty()) text += fmt::format(" and at {}", fmt::join(options.peers, ", "));
  std::vector<std::string> others = bus.participants();
  std::erase_if(others, is_own_family);
  if (others.empty())
    return text + ": no other participant" +
           (options.localhost_only || !options.interfaces.empty() ? "" : kOnlyHere);
  std::set<std::string> topics;
  for (const BusEndpoint& endpoint : bus.endpoints())
    if (const auto ros = ros_topic(endpoint.name); ros && !is_own_family(bus.participant_of(endpoint.guid)))
      topics.insert(ros->topic);
  constexpr std::size_t kMaxListedTopics = 12;
  const std::size_t named = std::min(topics.size(), kMaxListedTopics);
  text +=
      fmt::format(": {}, {}", counted(others.size(), "other participant"), counted(topics.size(), "topic"));
  if (named > 0)
    text += fmt::format(" ({}{})",
                        fmt::join(topics.begin(), std::next(topics.begin(), static_cast<long>(named)), ", "),
                        topics.size() > named ? ", …" : "");
  return text + (named > 0 ? "" : kNoTopics);
}

}  // namespace waymark
