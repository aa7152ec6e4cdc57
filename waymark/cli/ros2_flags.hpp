#pragma once

#include <string>

#include "waymark/drivers/dds/bus.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// Where on the network of ROS 2: flags over what ROS's environment variables say.
struct Ros2Flags {
  explicit Ros2Flags(CLI::App& app);
  Ros2Flags(const Ros2Flags&) = delete;
  Ros2Flags& operator=(const Ros2Flags&) = delete;

  /// Fails on variables of the environment that make no sense.
  [[nodiscard]] Result<BusOptions> options() const;

  int domain = -1;
  bool localhost = false;
  std::string interface {};
};

}  // namespace waymark::cli
