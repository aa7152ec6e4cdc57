#include "waymark/app/live/own_robot.hpp"

#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace waymark {

Result<RobotCommand> own_program(std::vector<std::string> words) {
  std::error_code error;
  const std::string self = std::filesystem::read_symlink("/proc/self/exe", error).string();
  if (error)
    return fail(ErrorCode::Unsupported, "the path of this program cannot be found: " + error.message());
  words.insert(words.begin(), self);
  return RobotCommand(std::move(words));
}

Status become_the_robot(RobotSetup& setup, std::vector<std::string> words, const SimulatedTime& time) {
  words.insert(words.begin(), "robot-sim");
  if (time.lockstep) words.emplace_back("--lockstep");
  if (time.lockstep && time.pace > 0) words.insert(words.end(), {"--pace", fmt::format("{}", time.pace)});
  auto process = own_program(std::move(words));
  if (!process) return tl::unexpected(process.error());
  setup.process = std::move(*process);
  return {};
}

}  // namespace waymark
