#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// What this program uses a topic for.
struct TopicUse {
  bool publishes = false;
  BusTopic name{};
  TopicQos qos{};
};

/// Why the endpoint and this program's use of the same topic do not match, in words: another type, or
/// qualities of service that exclude each other (DDS 1.4, section 2.2.3, "requested versus offered"). Nothing
/// where they match, or have nothing to do with each other.
[[nodiscard]] std::optional<std::string> mismatch(const TopicUse& ours, const BusEndpoint& theirs);

/// All that do not match.
[[nodiscard]] std::vector<std::string> mismatches(const std::vector<TopicUse>& ours,
                                                  const std::vector<BusEndpoint>& theirs);

/// Where was searched and what was found there, this program's own participants left out: "domain 0 on
/// 127.0.0.1: nobody", "domain 7 on 10.0.0.2, …: /node, 12 topics".
[[nodiscard]] std::string searched(const BusOptions& options, const Bus& bus);

/// The IPv4 addresses of this machine's network interfaces that are up.
[[nodiscard]] std::vector<std::string> interface_addresses();
/// Restricts the options to the interface of this address, or of this name ("eth0"). Fails, and names those
/// there are, where none has it and is up: DDS would join the domain on no interface at all.
[[nodiscard]] Status use_interface(BusOptions& options, const std::string& interface);
/// Whether the participant is this process, or one that it was started by: a program and the process of its
/// robot are one for people.
[[nodiscard]] bool is_own_family(const std::string& participant);

}  // namespace waymark
