#pragma once

#include <string>

#include "waymark/robots/dds/ros_environment.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// Where on the network of ROS 2: flags over what ROS's environment variables say.
class Ros2Flags {
 public:
  explicit Ros2Flags(CLI::App& app);
  Ros2Flags(const Ros2Flags&) = delete;
  Ros2Flags& operator=(const Ros2Flags&) = delete;

  /// As the node of this name. Fails on variables of the environment that make no sense, and on a release of
  /// ROS 2 that is none.
  [[nodiscard]] Result<BusOptions> options(const std::string& node = "waymark",
                                           const std::string& usual_distro = "") const;
  /// Fails when one of them was given, where nothing joins the network.
  [[nodiscard]] Status refuse_all(const std::string& why, const std::string& hint) const;

 private:
  const CLI::App& app_;
  RosPlace place_{};
};

}  // namespace waymark::cli
