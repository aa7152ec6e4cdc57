#pragma once

#include <memory>

#include "waymark/robots/gazebo/gazebo_link.hpp"

namespace waymark {

/// A node of Ignition Transport 11, which itself reads IGN_PARTITION and IGN_IP. Fails on a partition that
/// Ignition rejects.
[[nodiscard]] Result<std::unique_ptr<GazeboLink>> open_ignition_link();

}  // namespace waymark
