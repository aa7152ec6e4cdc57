#pragma once

#include <memory>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// Joins the domain with a participant of Fast DDS over UDP. Fails when it cannot be created: no such
/// interface, no free port, certificates that are refused.
[[nodiscard]] Result<std::unique_ptr<Bus>> open_fastdds_bus(const BusOptions& options);

}  // namespace waymark
