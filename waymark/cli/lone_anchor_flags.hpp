#pragma once

#include <string>

#include "waymark/live/robot_setup.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// What the map will stand on with --robot process:CMD, where no file of a world says it: --anchor and
/// --tag-size-m.
struct LoneAnchorFlags {
  std::string anchor{};
  double tag_size_m = 0;
};
void add_flags(CLI::App& app, LoneAnchorFlags& flags);

/// Gives the setup an anchor where its world is not known. Fails when it must be given and is not.
[[nodiscard]] Status check_live_setup(RobotSetup& setup, const LoneAnchorFlags& flags);

}  // namespace waymark::cli
