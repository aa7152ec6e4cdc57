#include "waymark/cli/page_flags.hpp"

#include <string_view>

#include <CLI/App.hpp>

#include "waymark/cli/job_flags.hpp"
#include "waymark/drivers/dds/ros_environment.hpp"

namespace waymark::cli {

void add_flags(CLI::App& app, PageOptions& page, CLI::Option* view) {
  add_fields(app, page);
  for (const char* name : {"--port", "--listen", "--token", "--open"}) {
    if (view != nullptr) app.get_option(name)->needs(view);
    if (view != nullptr && name != std::string_view("--open")) app.get_option(name)->group(kMoreGroup);
  }
}

void add_flags(CLI::App& app, ViewerOptions& flags) {
  CLI::Option* view =
      app.add_flag("--view", flags.view, "Show the robot in the browser while it runs, with buttons");
  add_flags(app, flags.page, view);
  CLI::Option* ros2 = add_flag(app, "--publish-ros2", flags.ros2,
                               "Publish pose, /tf, tags and path on the network of ROS 2, with services as "
                               "buttons: docs/howto/ros2.md",
                               kMore)
                          ->excludes(view);
  add_option(app, "--ros-distro NAME", flags.ros_distro, std::string(kRosDistroHelp), kMore)->needs(ros2);
}

}  // namespace waymark::cli
