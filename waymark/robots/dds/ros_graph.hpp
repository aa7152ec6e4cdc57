#pragma once

#include <string>
#include <vector>

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

}  // namespace waymark
