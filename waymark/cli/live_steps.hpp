#pragma once

#include <string>

#include "waymark/cli/loop_steps.hpp"

namespace CLI {
class App;
}

/// The steps of the loop for a robot that lives (--robot process:CMD). docs/formats/robot-process.md.
namespace waymark::cli {

/// What the map will stand on, where no file of a world says it.
struct LoneAnchorFlags {
  std::string anchor{};
  double tag_size_m = 0;
};
void add_flags(CLI::App& app, LoneAnchorFlags& flags);

/// Gives the setup an anchor where its world is not known. Fails when it must be given and is not.
[[nodiscard]] Status check_live_setup(RobotSetup& setup, const LoneAnchorFlags& flags);

/// Records a lap that somebody drives with the robot of the setup; "scripted" needs its world, and a robot
/// that knows the truth.
[[nodiscard]] Result<TeachReport> teach_live(const RobotSetup& setup, const TeachJob& job, Console& console);

/// Lets the robot of the setup drive the route of the folder.
[[nodiscard]] Result<ReplayReport> replay_live(const RobotSetup& setup, const ReplayJob& job,
                                               Console& console);

}  // namespace waymark::cli
