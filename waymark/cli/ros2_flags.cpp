#include "waymark/cli/ros2_flags.hpp"

#include <CLI/App.hpp>

#include "waymark/drivers/dds/ros_environment.hpp"

namespace waymark::cli {

Ros2Flags::Ros2Flags(CLI::App& app) {
  app.add_option("--domain", domain, "Domain of ROS 2; unless given: ROS_DOMAIN_ID, or 0")
      ->check(CLI::Range(0, 232))
      ->type_name("INTEGER");
  app.add_flag("--localhost", localhost, "Only this machine, as ROS_LOCALHOST_ONLY=1");
  app.add_option("--interface", interface, "IPv4 address of the only network interface to use")
      ->check(CLI::ValidIPV4)
      ->type_name("ADDRESS");
}

Result<BusOptions> Ros2Flags::options() const {
  BusOptions options;
  if (Status status = apply_ros_environment(options, process_environment()); !status)
    return tl::unexpected(status.error());
  if (domain >= 0) options.domain = domain;
  options.localhost_only = options.localhost_only || localhost;
  if (!interface.empty()) options.interfaces = {interface};
  return options;
}

}  // namespace waymark::cli
