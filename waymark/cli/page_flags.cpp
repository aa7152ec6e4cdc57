#include "waymark/cli/page_flags.hpp"

#include <array>
#include <cstddef>

#include <CLI/App.hpp>

#include "waymark/cli/flags.hpp"
#include "waymark/cli/ros2_flags.hpp"

namespace waymark::cli {

void add_flags(CLI::App& app, PageOptions& page, CLI::Option* view) {
  std::array<CLI::Option*, 4> all{};
  all[0] = app.add_option("--port", page.port, "Port of the page; where it is taken, any other. 0: any")
               ->check(CLI::Range(0, 65535))
               ->capture_default_str();
  all[1] = add_option(
      app, "--listen ADDRESS", page.listen,
      "Address of this machine at which others reach the page, 0.0.0.0 for all; they need the token", kShown);
  all[2] = add_option(
      app, "--token WORD", page.token,
      "Token that grants control and remote viewing: 16 characters or more. Unless given: a random one");
  all[3] = app.add_flag("--open", page.open, "Open the page in the browser");
  if (view == nullptr) return;
  for (CLI::Option* option : all) option->needs(view);
  for (std::size_t i = 0; i < 3; ++i) all[i]->group(kMoreGroup);
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
  add_option(app, "--ros-distro NAME", flags.ros_distro, kRosDistroHelp, kMore)->needs(ros2);
}

}  // namespace waymark::cli
