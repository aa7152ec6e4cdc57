#include "waymark/cli/gazebo_sim_flags.hpp"

#include <CLI/App.hpp>

#include "waymark/cli/interrupt.hpp"
#include "waymark/live/gazebo_robot_sim.hpp"

namespace waymark::cli {

GazeboSimFlags::GazeboSimFlags(CLI::App& app) {
  app.add_option("--gazebo", profile,
                 "Publish the topics of Gazebo that this profile names, as Gazebo's robot does, and obey its "
                 "command topic, until Ctrl-C: limo, or the path of a .yaml file")
      ->excludes("--limo", "--mbot")
      ->type_name("PROFILE");
}

Status GazeboSimFlags::apply(SimulatedSetup& setup) const {
  if (!chosen()) return {};
  constexpr double kNever_s = 1e6;
  setup.robot.watchdog_s = kNever_s;
  if (setup.pictures) return {};
  return fail(ErrorCode::InvalidArgument, "Gazebo's topics carry pictures, not the corners of tags",
              {.key = "--gazebo"}, "Add --images.");
}

Status GazeboSimFlags::run(Plant& plant, const CameraModel& camera) const {
  const auto found = find_gazebo_profile(profile);
  if (!found) return tl::unexpected(found.error());
  const auto link = open_gazebo();
  if (!link) return tl::unexpected(link.error());
  return run_gazebo_robot_sim(**link, *found, plant, camera, interrupted);
}

}  // namespace waymark::cli
