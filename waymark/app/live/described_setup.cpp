#include "waymark/app/live/described_setup.hpp"

#include "waymark/app/live/robot_kinds.hpp"

namespace waymark {

std::vector<std::string> RobotWords::as_words() const {
  std::vector<std::string> words = {"--world", world, "--seed", std::to_string(seed)};
  if (!robot_file.empty()) words.insert(words.end(), {"--robot-file", robot_file});
  return words;
}

Result<RobotSetup> described_setup(const RobotWords& words, bool processes, const std::string& robot_file,
                                   const GivenFlags& given) {
  const bool process = processes && is_robot_kind(words.robot);
  const char* of_a_process = "Leave it out, or give --robot process:CMD.";
  FlagRefusals refused(given);
  refused.flags(!process, {"--detector", "--search-every", "--search-strips"},
                "a simulated robot finds its tags in another way", of_a_process);
  refused.flags(!process, {"--camera-source"}, "a simulated robot has simulated cameras", of_a_process);
  refused.flags(process && !given("--search-every"), {"--search-strips"}, kSearchedWholly, kSearchEvery);
  if (!refused.status()) return tl::unexpected(refused.status().error());
  const std::string& file = words.robot_file.empty() ? robot_file : words.robot_file;
  Result<RobotSetup> setup = load_robot(words.robot, words.world, file, words.seed, processes);
  if (!setup || !process) return setup;
  setup->pictures = words.pictures;
  if (Status added = add_live_cameras(words.camera_sources, *setup); !added)
    return tl::unexpected(added.error());
  return setup;
}

}  // namespace waymark
