#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// Releases of ROS 2 by their names, oldest first.
[[nodiscard]] std::vector<std::string> ros_distros();

/// What makes a participant a node for `ros2 node list` and `ros2 node info`: ParticipantEntitiesInfo of
/// rmw_dds_common on ros_discovery_info, whose Gid has 24 bytes up to Humble and 16 since. Programs of a
/// release that expects the other size read it wrongly, and those of 2025 and before may crash by it
/// (ros2/rmw_fastrtps#797): it is told only where somebody named the release. Fails on a name that is none,
/// with the nearest.
[[nodiscard]] Result<SelfDescription> ros_node_description(const std::string& distro,
                                                           const std::string& node);
/// The same for the node of the options; without a name of a release nothing.
[[nodiscard]] Status show_in_node_list(BusOptions& options, const std::string& distro);

/// The value of an environment variable; nothing where it is not set.
using Environment = std::function<std::optional<std::string>(const char* name)>;
[[nodiscard]] Environment process_environment();

/// What ROS 2 programs read from the environment, over `options`: ROS_DOMAIN_ID (0 to 232),
/// ROS_LOCALHOST_ONLY (0 or 1), ROS_AUTOMATIC_DISCOVERY_RANGE (SUBNET, LOCALHOST, SYSTEM_DEFAULT),
/// ROS_STATIC_PEERS (IPv4 addresses, separated by semicolons), ROS_SECURITY_KEYSTORE with ROS_SECURITY_ENABLE
/// and ROS_SECURITY_ENCLAVE_OVERRIDE. Fails on a value that makes no sense, as ROS does.
[[nodiscard]] Status apply_ros_environment(BusOptions& options, const Environment& environment);

/// Of the field `ros_distro` of what joins the network.
inline constexpr std::string_view kRosDistroHelp =
    "Release of ROS 2 whose `ros2 node list` shows this program: humble, jazzy, ...; unless given: none "
    "does. A wrong one may crash its programs";

/// Where on the network of ROS 2, as a user says it.
struct RosPlace {
  int domain = -1;           ///< negative: as the environment says
  bool localhost = false;    ///< only this machine
  std::string interface {};  ///< the only one to use: its name or IPv4 address; empty: all
  std::string distro{};      ///< release whose node list shows this program; empty: none does

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.domain,
          JobField("domain INTEGER", "Domain of ROS 2; unless given: ROS_DOMAIN_ID, or 0", 0, 232)
              .without_usual());
    visit(self.localhost, JobField("localhost", "Only this machine, as ROS_LOCALHOST_ONLY=1"));
    visit(self.interface,
          JobField("interface NAME", "Only network interface to use: its name or IPv4 address")
              .excludes("localhost"));
    visit(self.distro, JobField("ros_distro NAME", kRosDistroHelp).less());
  }
};

/// As the node of this name: the place over what the environment says. Errors: of the environment; what
/// use_interface() and show_in_node_list() refuse.
[[nodiscard]] Result<BusOptions> bus_options(const RosPlace& place, const std::string& node,
                                             const Environment& environment);

}  // namespace waymark
