#pragma once

#include <memory>
#include <string>

#include "waymark/cli/console.hpp"
#include "waymark/live/live_page.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace waymark::cli {

/// The flags of every verb that serves the page. With `view`, they mean something only where it is given.
void add_flags(CLI::App& app, PageOptions& page, CLI::Option* view = nullptr);

/// --view, and the flags of the page with it.
struct LiveFlags {
  bool view = false;
  bool ros2 = false;  ///< published on the network of ROS 2
  std::string ros_distro{};
  PageOptions page{};
};
void add_flags(CLI::App& app, LiveFlags& flags);

/// The page of a robot that runs; nullptr without --view and --publish-ros2.
[[nodiscard]] Result<std::unique_ptr<LivePage>> start_page(const LiveFlags& flags, const RobotSetup& setup,
                                                           Console& console);
/// The same of a live camera without a robot.
[[nodiscard]] Result<std::unique_ptr<LivePage>> start_page(const LiveFlags& flags, const std::string& camera,
                                                           Console& console);

}  // namespace waymark::cli
