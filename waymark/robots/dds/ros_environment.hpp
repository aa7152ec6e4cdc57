#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// Names of the ROS 2 releases, oldest first.
[[nodiscard]] std::vector<std::string> ros_distros();

/// The message that makes `ros2 node list` and `ros2 node info` show a participant as a node:
/// ParticipantEntitiesInfo from rmw_dds_common on ros_discovery_info. Its Gid has 24 bytes up to Humble and
/// 16 bytes in later releases. Programs from a release that expects the other size misread it; those from
/// 2025 or earlier may crash (ros2/rmw_fastrtps#797). It is therefore sent only if the release is specified.
/// An unknown release is an error, which suggests the nearest name.
[[nodiscard]] Result<SelfDescription> ros_node_description(const std::string& distro,
                                                           const std::string& node);
/// Sets `options.self` to that message for the node named in the options; does nothing if `distro` is empty.
[[nodiscard]] Status show_in_node_list(BusOptions& options, const std::string& distro);

/// Returns the value of an environment variable; `nullopt` if it is not set.
using Environment = std::function<std::optional<std::string>(const char* name)>;
[[nodiscard]] Environment process_environment();

/// Applies to `options` the environment variables that ROS 2 programs read: ROS_DOMAIN_ID (0 to 232),
/// ROS_LOCALHOST_ONLY (0 or 1), ROS_AUTOMATIC_DISCOVERY_RANGE (SUBNET, LOCALHOST, SYSTEM_DEFAULT),
/// ROS_STATIC_PEERS (IPv4 addresses, separated by semicolons), ROS_SECURITY_KEYSTORE with ROS_SECURITY_ENABLE
/// and ROS_SECURITY_ENCLAVE_OVERRIDE. Fails if a value is invalid, as ROS does.
[[nodiscard]] Status apply_ros_environment(BusOptions& options, const Environment& environment);

/// Help text for the field `ros_distro`.
inline constexpr std::string_view kRosDistroHelp =
    "ROS 2 release whose `ros2 node list` shows this program: humble, jazzy, ...; default: none. A wrong "
    "release may crash its programs";

/// The part of the ROS 2 network that the user has selected.
struct RosPlace {
  int domain = -1;           ///< taken from the environment if negative
  bool localhost = false;    ///< restricted to this machine
  std::string interface {};  ///< name or IPv4 address of the only interface to use; all if empty
  std::string distro{};      ///< release whose node list should show this program; none if empty

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.domain, JobField("domain INTEGER", "ROS 2 domain; unless given: ROS_DOMAIN_ID, or 0", 0, 232)
                           .without_default());
    visit(self.localhost, JobField("localhost", "Use only this machine, like ROS_LOCALHOST_ONLY=1"));
    visit(self.interface,
          JobField("interface NAME", "Only network interface to use: its name or IPv4 address")
              .excludes("localhost"));
    visit(self.distro, JobField("ros_distro NAME", kRosDistroHelp).less());
  }
};

/// Bus options for the node with this name; `place` overrides the environment. Errors: invalid environment
/// variables, and those of use_interface() and show_in_node_list().
[[nodiscard]] Result<BusOptions> bus_options(const RosPlace& place, const std::string& node,
                                             const Environment& environment);

}  // namespace waymark
