#include "waymark/cli/ros2_flags.hpp"

#include "waymark/cli/flags.hpp"
#include "waymark/cli/options_flags.hpp"

namespace waymark::cli {

Ros2Flags::Ros2Flags(CLI::App& app) : app_(app) {
  add_option(app, "--domain INTEGER", place_.domain, "Domain of ROS 2; unless given: ROS_DOMAIN_ID, or 0",
             between(0, 232));
  CLI::Option* const local =
      app.add_flag("--localhost", place_.localhost, "Only this machine, as ROS_LOCALHOST_ONLY=1");
  add_option(app, "--interface NAME", place_.interface,
             "Only network interface to use: its name or IPv4 address")
      ->excludes(local);
  add_option(app, "--ros-distro NAME", place_.distro, kRosDistroHelp, kMore);
}

Status Ros2Flags::refuse_all(const std::string& why, const std::string& hint) const {
  Refusals refused(app_);
  refused.flags(true, {"--domain", "--localhost", "--interface", "--ros-distro"}, why, hint);
  return refused.status();
}

Result<BusOptions> Ros2Flags::options(const std::string& node, const std::string& usual_distro) const {
  RosPlace place = place_;
  if (place.distro.empty()) place.distro = usual_distro;
  return bus_options(place, node, process_environment());
}

}  // namespace waymark::cli
