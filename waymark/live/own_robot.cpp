#include "waymark/live/own_robot.hpp"

#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace waymark {

Status become_the_robot(RobotSetup& setup, std::vector<std::string> words, const SimulatedTime& time) {
  std::error_code error;
  const std::string self = std::filesystem::read_symlink("/proc/self/exe", error).string();
  if (error)
    return fail(ErrorCode::Unsupported, "this program does not know its own name: " + error.message());
  words.insert(words.begin(), {self, "robot-sim"});
  if (time.lockstep) words.emplace_back("--lockstep");
  if (time.lockstep && time.pace > 0) words.insert(words.end(), {"--pace", fmt::format("{}", time.pace)});
  setup.process = RobotCommand(std::move(words));
  return {};
}

}  // namespace waymark
