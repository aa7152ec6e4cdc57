#include "waymark/robots/ros2/other_publishers.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/message_text.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/robots/dds/ros_names.hpp"
#include "waymark/robots/process/command_sender.hpp"

namespace waymark {
namespace {

/// rmw_dds_common/msg/Gid, whose size has changed between releases while its name has not.
template <std::size_t kSize>
struct Gid {
  std::array<std::uint8_t, kSize> data{};
  WAYMARK_ROS2_FIELDS(self.data)
};
template <std::size_t kSize>
struct NodeEntitiesInfo {
  std::string node_namespace{};
  std::string node_name{};
  std::vector<Gid<kSize>> readers{};
  std::vector<Gid<kSize>> writers{};
  WAYMARK_ROS2_FIELDS(self.node_namespace, self.node_name, self.readers, self.writers)
};
template <std::size_t kSize>
struct ParticipantEntitiesInfo {
  Gid<kSize> gid{};
  std::vector<NodeEntitiesInfo<kSize>> nodes{};
  WAYMARK_ROS2_FIELDS(self.gid, self.nodes)
};

template <std::size_t kSize>
void add_nodes(const ParticipantEntitiesInfo<kSize>& info, std::map<Guid, std::string>& names) {
  for (const NodeEntitiesInfo<kSize>& node : info.nodes) {
    const bool slash = node.node_namespace.ends_with('/');
    const std::string name = printable(node.node_namespace + (slash ? "" : "/") + node.node_name);
    for (const Gid<kSize>& writer : node.writers) {
      Guid guid{};
      std::copy_n(writer.data.begin(), guid.size(), guid.begin());
      names[guid] = name;
    }
  }
}

}  // namespace

Status PublisherNames::join(Bus& bus) {
  const BusTopic topic{"ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"};
  const auto number = bus.subscribe(topic, {.transient_local = true, .depth = 100});
  if (!number) return tl::unexpected(number.error());
  subscription_ = *number;
  return {};
}

bool PublisherNames::take(const BusMessage& message) {
  if (message.subscription != subscription_) return false;
  add(message.bytes);
  return true;
}

/// In the longer Gid, the eight bytes after the GUID are zero. The shorter one is followed by the number of
/// nodes.
void PublisherNames::add(std::span<const std::uint8_t> cdr) {
  constexpr std::size_t kLonger = 24;
  const auto longer = cdr::decode<ParticipantEntitiesInfo<kLonger>>(cdr);
  const auto is_zero = [](std::uint8_t byte) { return byte == 0; };
  if (longer && std::all_of(longer->gid.data.begin() + sizeof(Guid), longer->gid.data.end(), is_zero))
    return add_nodes(*longer, nodes_);
  if (const auto shorter = cdr::decode<ParticipantEntitiesInfo<sizeof(Guid)>>(cdr))
    add_nodes(*shorter, nodes_);
}

/// Ignores participant names that begin with a slash: ROS participants are named after their enclave, which
/// many of them share.
std::string PublisherNames::of(const std::set<Guid>& publishers, const Bus& bus) const {
  std::set<std::string> names;
  for (const Guid& publisher : publishers) {
    const auto node = nodes_.find(publisher);
    std::string name = node != nodes_.end() ? node->second : printable(bus.participant_of(publisher));
    if (node != nodes_.end() || !(name.empty() || name.starts_with('/'))) names.insert(std::move(name));
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

std::set<Guid> publishers_of(const BusTopic& topic, const Bus& bus) {
  std::set<Guid> found;
  for (const BusEndpoint& endpoint : bus.endpoints())
    if (endpoint.publishes && endpoint.name.topic == topic.topic) found.insert(endpoint.guid);
  return found;
}

bool OtherDrivers::receive(const Guid& from, bool drives, const Bus& bus) {
  if (from == own_) return false;
  if (drives && !publishers_of(commands_, bus).contains(from)) {
    own_ = from;
    return false;
  }
  commanders_.insert(from);
  while_driving_ += drives ? 1 : 0;
  return true;
}

Result<std::string> OtherDrivers::found(const PublisherNames& names, const Bus& bus, Duration driving) const {
  constexpr Duration kSimultaneous = std::chrono::seconds(3);
  if (while_driving_ < kMinCommandsOfDriver) return std::string();
  const std::string who = names.of(commanders_, bus);
  const std::string text =
      fmt::format("another program commands this robot{}", who.empty() ? "" : ", " + who);
  if (driving >= kSimultaneous) return text + ", and the robot obeys both in turn: stop one of them";
  const auto topic = ros_topic(commands_);
  return fail(ErrorCode::InvalidArgument, text + "; both started at the same time",
              {.source = topic ? topic->topic : commands_.topic}, "Start only one of them.");
}

}  // namespace waymark
