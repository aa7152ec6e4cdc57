#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// A topic that this program publishes or subscribes to.
struct TopicUse {
  bool publishes = false;
  BusTopic name{};
  TopicQos qos{};
};

/// Explains why another program's endpoint does not match this program's use of the same topic: a different
/// type, or incompatible quality of service (DDS 1.4, section 2.2.3, "requested versus offered"). `nullopt`
/// if they match or are unrelated (different topic, same direction).
[[nodiscard]] std::optional<std::string> mismatch(const TopicUse& ours, const BusEndpoint& theirs);

/// The messages for all mismatches, without duplicates.
[[nodiscard]] std::vector<std::string> mismatches(const std::vector<TopicUse>& ours,
                                                  const std::vector<BusEndpoint>& theirs);

/// Summarises where discovery searched and what it found, excluding this program's own participants.
/// Examples: "domain 0 on 127.0.0.1: no other participant", "domain 7 on 10.0.0.2: 1 other participant, 12
/// topics (/odom, …)".
[[nodiscard]] std::string searched(const BusOptions& options, const Bus& bus);

/// The IPv4 addresses of those network interfaces of this machine that are up.
[[nodiscard]] std::vector<std::string> interface_addresses();
/// Restricts the options to the interface with this address or name ("eth0"). If no such interface is up,
/// fails and lists the available ones, because otherwise DDS would join the domain without any interface.
[[nodiscard]] Status use_interface(BusOptions& options, const std::string& interface);
/// Whether the participant belongs to this process or one of its ancestors. To a user, a program and its
/// robot process are one program.
[[nodiscard]] bool is_own_family(const std::string& participant);

}  // namespace waymark
