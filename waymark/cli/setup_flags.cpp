#include "waymark/cli/setup_flags.hpp"

#include <fmt/format.h>

#include "waymark/cli/job_flags.hpp"
#include "waymark/live/robot_kinds.hpp"

namespace waymark::cli {

SetupFlags::SetupFlags(CLI::App& app, const std::string& world, bool processes,
                       const std::string& robot_file_default)
    : app_(app), processes_(processes), world_(world) {
  add_option(app, "--robot NAME", robot_, robot_kinds_help(processes), kShown);
  CLI::Option* world_flag =
      add_option(app, "--world NAME", world_, fmt::format("World of the simulated robot: {}", kWorldNames));
  if (world.empty() && !processes) world_flag->required();
  if (!world.empty()) world_flag->capture_default_str();
  add_option(app, "--robot-file NAME", robot_file_,
             fmt::format("Body, camera and behaviour of the robot: {}. Unless given: {}the robot that the "
                         "world names, or limo",
                         kRobotNames, robot_file_default));
  if (processes)
    add_option(app, "--camera-source ADDRESS", live_cameras_,
               "Camera of this computer that gives the pictures of a robot which sends none, with --robot "
               "process:CMD: v4l2:/dev/video0, or NAME=ADDRESS where the robot's file names several",
               kMore);
  if (processes) add_fields(app, pictures_);
  add_option(app, "--seed INTEGER", seed_, "Seed of all noise: the same seed gives the same bytes", kShown)
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53, "INTEGER"));
}

void SetupFlags::refuse_seed(bool when, Refusals& refused) {
  refused.flags(when, {"--seed"}, "nothing is drawn at random for a robot that is a process",
                "Leave it out; a simulated process takes a seed of its own.");
}

std::vector<std::string> SetupFlags::as_words() const {
  std::vector<std::string> words = {"--world", world_, "--seed", std::to_string(seed_)};
  if (!robot_file_.empty()) words.insert(words.end(), {"--robot-file", robot_file_});
  return words;
}

Result<RobotSetup> SetupFlags::make(const std::string& robot_file) const {
  const bool process = processes_ && is_robot_kind(robot_);
  const char* of_a_process = "Leave it out, or give --robot process:CMD.";
  Refusals refused(app_);
  refused.flags(!process, {"--detector", "--search-every", "--search-strips"},
                "a simulated robot finds its tags in another way", of_a_process);
  refused.flags(!process, {"--camera-source"}, "a simulated robot has simulated cameras", of_a_process);
  refused.flags(process && app_.count("--search-every") == 0, {"--search-strips"}, kSearchedWholly,
                kSearchEvery);
  if (!refused.status()) return tl::unexpected(refused.status().error());
  const std::string& file = robot_file_.empty() ? robot_file : robot_file_;
  Result<RobotSetup> setup = load_robot(robot_, world_, file, seed_, processes_);
  if (!setup || !process) return setup;
  setup->pictures = pictures_;
  if (Status added = add_live_cameras(live_cameras_, *setup); !added) return tl::unexpected(added.error());
  return setup;
}

}  // namespace waymark::cli
