#include "waymark/app/cli/ros2_flags.hpp"

#include "waymark/app/cli/job_flags.hpp"
#include "waymark/app/cli/options_flags.hpp"

namespace waymark::cli {

Ros2Flags::Ros2Flags(CLI::App& app) : app_(app) { add_fields(app, place_); }

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
