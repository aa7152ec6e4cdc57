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
/// ParticipantEntitiesInfo of rmw_dds_common on ros_discovery_info. Its Gid has 24 bytes up to Humble and 16
/// bytes since. Programs of a release that expects the other size misread it; those from 2025 and before may
/// crash (ros2/rmw_fastrtps#797). It is therefore sent only if the release is given. An unknown release is an
/// error that suggests the nearest name.
[[nodiscard]] Result<SelfDescription> ros_node_description(const std::string& distro,
                                                           const std::string& node);
/// Sets `options.self` to that message for the options' node; does nothing if `distro` is empty.
[[nodiscard]] Status show_in_node_list(BusOptions& options, const std::string& distro);

/// Returns the value of an environment variable; empty if it is not set.
using Environment = std::function<std::optional<std::string>(const char* name)>;
[[nodiscard]] Environment process_environment();

/// Applies the environment variables that ROS 2 programs read to `options`: ROS_DOMAIN_ID (0 to 232),
/// ROS_LOCALHOST_ONLY (0 or 1), ROS_AUTOMATIC_DISCOVERY_RANGE (SUBNET, LOCALHOST, SYSTEM_DEFAULT),
/// ROS_STATIC_PEERS (IPv4 addresses, separated by semicolons), ROS_SECURITY_KEYSTORE with ROS_SECURITY_ENABLE
/// and ROS_SECURITY_ENCLAVE_OVERRIDE. Fails on an invalid value, like ROS.
[[nodiscard]] Status apply_ros_environment(BusOptions& options, const Environment& environment);

/// Help of the field `ros_distro`.
inline constexpr std::string_view kRosDistroHelp =
    "ROS 2 release whose `ros2 node list` shows this program: humble, jazzy, ...; default: none. A wrong "
    "release may crash its programs";

/// The part of the ROS 2 network that the user selects.
struct RosPlace {
  int domain = -1;           ///< negative: from the environment
  bool localhost = false;    ///< only this machine
  std::string interface {};  ///< name or IPv4 address of the only interface to use; empty: all
  std::string distro{};      ///< release whose node list shows this program; empty: none

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

/// Bus options of the node with this name; `place` overrides the environment. Errors: invalid environment
/// variables, and those of use_interface() and show_in_node_list().
[[nodiscard]] Result<BusOptions> bus_options(const RosPlace& place, const std::string& node,
                                             const Environment& environment);

}  // namespace waymark
