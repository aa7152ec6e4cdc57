#include "waymark/robots/dds/ros_environment.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <string_view>
#include <utility>

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/robots/dds/discovery.hpp"

namespace waymark {
namespace {

struct Distro {
  std::string_view name;
  std::size_t gid_bytes;
};
constexpr std::array<Distro, 10> kDistros = {{{"dashing", 24},
                                              {"eloquent", 24},
                                              {"foxy", 24},
                                              {"galactic", 24},
                                              {"humble", 24},
                                              {"iron", 16},
                                              {"jazzy", 16},
                                              {"kilted", 16},
                                              {"lyrical", 16},
                                              {"rolling", 16}}};

/// Writes plain little-endian CDR.
class Writer {
 public:
  void number(std::size_t value) {
    while ((bytes_.size() - kEncapsulation) % 4 != 0) bytes_.push_back(0);
    for (unsigned shift = 0; shift < 32; shift += 8)
      bytes_.push_back(static_cast<std::uint8_t>((value >> shift) & 0xffU));
  }
  void text(std::string_view value) {
    number(value.size() + 1);
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    bytes_.push_back(0);
  }
  /// Writes a Gid; the bytes after the GUID are zero.
  void gid(const Guid& guid, std::size_t size) {
    bytes_.insert(bytes_.end(), guid.begin(), guid.end());
    bytes_.insert(bytes_.end(), size - guid.size(), 0);
  }
  void gids(const std::vector<Guid>& all, std::size_t size) {
    number(all.size());
    for (const Guid& one : all) gid(one, size);
  }
  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  static constexpr std::size_t kEncapsulation = 4;
  std::vector<std::uint8_t> bytes_ = {0, 1, 0, 0};
};

}  // namespace

std::vector<std::string> ros_distros() {
  std::vector<std::string> names;
  names.reserve(kDistros.size());
  for (const Distro& one : kDistros) names.emplace_back(one.name);
  return names;
}

Result<SelfDescription> ros_node_description(const std::string& distro, const std::string& node) {
  const auto* release = std::ranges::find(kDistros, distro, &Distro::name);
  if (release == kDistros.end())
    return fail(ErrorCode::InvalidArgument, fmt::format("unknown ROS 2 release '{}'", distro),
                {.key = "ros_distro"}, suggestion(distro, ros_distros()));
  const auto bytes = [node, size = release->gid_bytes](const OwnEndpoints& own) {
    Writer out;
    out.gid(own.participant, size);
    out.number(1);  // node
    out.text("/");
    out.text(node);
    out.gids(own.subscriptions, size);
    out.gids(own.publishers, size);
    return out.take();
  };
  return SelfDescription{{"ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"},
                         bytes};
}

Status show_in_node_list(BusOptions& options, const std::string& distro) {
  if (distro.empty()) return {};
  auto self = ros_node_description(distro, options.node);
  if (!self) return tl::unexpected(self.error());
  options.self = std::move(*self);
  return {};
}

namespace {

constexpr int kMaxDomain = 232;  // there are no UDP ports for larger domains (RTPS 2.2, section 9.6.1.1)

tl::unexpected<Error> invalid_variable(const char* name, const std::string& value, std::string hint) {
  return fail(ErrorCode::InvalidArgument, fmt::format("invalid value '{}'", value),
              {.source = "environment", .key = name}, std::move(hint));
}

Status read_domain(BusOptions& options, const std::string& value) {
  int domain = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), domain);
  if (error != std::errc() || end != value.data() + value.size() || domain < 0 || domain > kMaxDomain)
    return invalid_variable("ROS_DOMAIN_ID", value, "Set an integer from 0 to 232.");
  options.domain = domain;
  return {};
}

Status read_range(BusOptions& options, const std::string& value) {
  if (value == "LOCALHOST") {
    options.localhost_only = true;
  } else if (value == "OFF") {
    return fail(ErrorCode::InvalidArgument, "OFF disables discovery, so no other program can be found",
                {.source = "environment", .key = "ROS_AUTOMATIC_DISCOVERY_RANGE"},
                "Set SUBNET, LOCALHOST or SYSTEM_DEFAULT.");
  } else if (value != "SUBNET" && value != "SYSTEM_DEFAULT") {
    return invalid_variable("ROS_AUTOMATIC_DISCOVERY_RANGE", value,
                            "Set SUBNET, LOCALHOST or SYSTEM_DEFAULT.");
  }
  return {};
}

/// The IPv4 address for a host name or address; empty if it cannot be resolved.
std::string address_of(const std::string& host) {
  addrinfo wanted{};
  wanted.ai_family = AF_INET;
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(host.c_str(), nullptr, &wanted, &found) != 0) return {};
  std::array<char, INET_ADDRSTRLEN> text{};
  const auto* address = reinterpret_cast<const sockaddr_in*>(found->ai_addr);
  const bool converted = inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size()) != nullptr;
  freeaddrinfo(found);
  return converted ? text.data() : "";
}

Status read_peers(BusOptions& options, std::string value) {
  while (!value.empty()) {
    const std::size_t end = std::min(value.find(';'), value.size());
    const std::string peer = value.substr(0, end);
    value.erase(0, end + 1);
    if (peer.empty()) continue;
    const std::string address = address_of(peer);
    if (address.empty())
      return fail(ErrorCode::InvalidArgument, fmt::format("host '{}' has no IPv4 address", peer),
                  {.source = "environment", .key = "ROS_STATIC_PEERS"},
                  "Set IPv4 addresses or resolvable host names, separated by semicolons.");
    options.peers.push_back(address);
  }
  return {};
}

}  // namespace

Environment process_environment() {
  return [](const char* name) -> std::optional<std::string> {
    const char* value = std::getenv(name);
    return value == nullptr ? std::nullopt : std::optional<std::string>(value);
  };
}

Status apply_ros_environment(BusOptions& options, const Environment& environment) {
  Status status;
  const auto on = [&](const char* name) { return environment(name).value_or(""); };
  if (const std::string domain = on("ROS_DOMAIN_ID"); !domain.empty()) status = read_domain(options, domain);
  if (const std::string only = on("ROS_LOCALHOST_ONLY"); status && !only.empty()) {
    if (only != "0" && only != "1") status = invalid_variable("ROS_LOCALHOST_ONLY", only, "Set 0 or 1.");
    options.localhost_only = options.localhost_only || only == "1";
  }
  if (const std::string range = on("ROS_AUTOMATIC_DISCOVERY_RANGE"); status && !range.empty())
    status = read_range(options, range);
  if (status) status = read_peers(options, on("ROS_STATIC_PEERS"));
  if (const std::string enclave = on("ROS_SECURITY_ENCLAVE_OVERRIDE"); !enclave.empty()) {
    if (!enclave.starts_with('/') && status)
      status =
          invalid_variable("ROS_SECURITY_ENCLAVE_OVERRIDE", enclave, "Set a name that begins with a slash.");
    options.enclave = enclave;
  }
  if (on("ROS_SECURITY_ENABLE") == "true" && on("ROS_SECURITY_KEYSTORE").empty() && status)
    status =
        fail(ErrorCode::InvalidArgument, "ROS_SECURITY_ENABLE=true requires a keystore, but none is set",
             {.source = "environment", .key = "ROS_SECURITY_KEYSTORE"},
             "Set the folder that `ros2 security create_keystore` created, or unset ROS_SECURITY_ENABLE.");
  if (on("ROS_SECURITY_ENABLE") == "true")
    options.keystore = on("ROS_SECURITY_KEYSTORE") + "/enclaves" + on("ROS_SECURITY_ENCLAVE_OVERRIDE");
  return status;
}

Result<BusOptions> bus_options(const RosPlace& place, const std::string& node,
                               const Environment& environment) {
  BusOptions options{.node = node};
  if (Status status = apply_ros_environment(options, environment); !status)
    return tl::unexpected(status.error());
  if (place.domain >= 0) options.domain = place.domain;
  options.localhost_only = options.localhost_only || place.localhost;
  if (!place.interface.empty()) {
    if (Status there = use_interface(options, place.interface); !there) return tl::unexpected(there.error());
    options.localhost_only = false;
  }
  if (Status status = show_in_node_list(options, place.distro); !status)
    return tl::unexpected(status.error());
  return options;
}

}  // namespace waymark
