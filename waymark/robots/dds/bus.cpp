#include "waymark/robots/dds/bus.hpp"

#include "waymark/modules/load_module.hpp"
#include "waymark/robots/dds/ros_environment.hpp"

namespace waymark {

Result<std::unique_ptr<Bus>> open_bus(const BusOptions& options) {
  const auto symbol = load_module({.file = "libwaymark-dds.so",
                                   .symbol = kOpenBusSymbol,
                                   .purpose = "ROS 2",
                                   .needs = "libfastrtps2.9 (Fast DDS)",
                                   .build = "libfastrtps-dev"});
  if (!symbol) return tl::unexpected(symbol.error());
  const auto open = reinterpret_cast<OpenBusFunction>(*symbol);
  std::unique_ptr<Bus> bus;
  Error error;
  (*open)(options, bus, error);
  if (!bus) return tl::unexpected(error);
  return bus;
}

Result<std::unique_ptr<Bus>> open_bus() {
  BusOptions options;
  if (Status status = apply_ros_environment(options, process_environment()); !status)
    return tl::unexpected(status.error());
  return open_bus(options);
}

}  // namespace waymark
