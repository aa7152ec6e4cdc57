#include "waymark/app/cli/setup_flags.hpp"

#include <fmt/format.h>

#include "waymark/app/cli/job_flags.hpp"
#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/config/share.hpp"

namespace waymark::cli {

SetupFlags::SetupFlags(CLI::App& app, const std::string& world, bool processes,
                       const std::string& robot_file_default)
    : app_(app), processes_(processes) {
  words_.world = world;
  add_option(app, "--robot NAME", words_.robot, robot_kinds_help(processes), kShown);
  CLI::Option* world_flag = add_option(app, "--world NAME", words_.world,
                                       fmt::format("World of the simulated robot: {}", kWorldNames));
  if (world.empty() && !processes) world_flag->required();
  if (!world.empty()) world_flag->capture_default_str();
  add_option(app, "--robot-file NAME", words_.robot_file,
             fmt::format("Body, camera and behaviour of the robot: {}. Unless given: {}the robot that the "
                         "world names, or limo",
                         kRobotNames, robot_file_default));
  if (processes)
    add_option(app, "--camera-source ADDRESS", words_.camera_sources,
               "Camera of this computer that gives the pictures of a robot which sends none, with --robot "
               "process:CMD: v4l2:/dev/video0, or NAME=ADDRESS where the robot's file names several",
               kMore);
  if (processes) add_fields(app, words_.pictures);
  add_option(app, "--seed INTEGER", words_.seed, "Seed of all noise: the same seed gives the same bytes",
             kShown)
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53, "INTEGER"));
}

}  // namespace waymark::cli
