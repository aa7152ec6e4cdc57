#pragma once

#include <memory>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// The function that the module with the DDS implementation exports, and its name there. `Result` crosses no
/// border of C: the bus, or the error, is put where the arguments say.
using OpenBusFunction = void (*)(const BusOptions&, std::unique_ptr<Bus>&, Error&);
inline constexpr const char* kOpenBusSymbol = "waymark_open_bus";

/// Joins the domain. The module libwaymark-dds.so is loaded by the first call: beside the program that runs,
/// or in ../lib/waymark. Fails where it is not there, cannot be loaded, or cannot join.
[[nodiscard]] Result<std::unique_ptr<Bus>> open_bus(const BusOptions& options);
/// As the environment variables of ROS say (apply_ros_environment()).
[[nodiscard]] Result<std::unique_ptr<Bus>> open_bus();

}  // namespace waymark
