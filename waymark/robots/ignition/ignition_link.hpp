#pragma once

#include <memory>

#include "waymark/robots/gazebo/gazebo_link.hpp"

namespace waymark {

/// A node using Ignition Transport 11, which itself reads IGN_PARTITION and IGN_IP. Fails if Ignition rejects
/// the partition.
[[nodiscard]] Result<std::unique_ptr<GazeboLink>> open_ignition_link();

}  // namespace waymark
