#include "waymark/cli/ros2_flags.hpp"

#include "waymark/cli/flags.hpp"
#include "waymark/drivers/dds/discovery.hpp"
#include "waymark/drivers/dds/ros_environment.hpp"
#include "waymark/drivers/dds/ros_graph.hpp"

namespace waymark::cli {

Ros2Flags::Ros2Flags(CLI::App& app) {
  add_option(app, "--domain INTEGER", domain, "Domain of ROS 2; unless given: ROS_DOMAIN_ID, or 0",
             between(0, 232));
  CLI::Option* const local =
      app.add_flag("--localhost", localhost, "Only this machine, as ROS_LOCALHOST_ONLY=1");
  add_option(app, "--interface NAME", interface, "Only network interface to use: its name or IPv4 address")
      ->excludes(local);
  add_option(app, "--ros-distro NAME", distro, kRosDistroHelp, kMore);
}

Result<BusOptions> Ros2Flags::options(const std::string& node, const std::string& usual_distro) const {
  BusOptions options{.node = node};
  if (Status status = apply_ros_environment(options, process_environment()); !status)
    return tl::unexpected(status.error());
  if (domain >= 0) options.domain = domain;
  options.localhost_only = options.localhost_only || localhost;
  if (!interface.empty()) {
    if (Status there = use_interface(options, interface); !there) {
      there.error().place.key = "--interface";
      return tl::unexpected(there.error());
    }
    options.localhost_only = false;
  }
  if (Status status = show_in_node_list(options, distro.empty() ? usual_distro : distro); !status)
    return tl::unexpected(status.error());
  return options;
}

}  // namespace waymark::cli
