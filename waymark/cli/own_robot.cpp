#include "waymark/cli/own_robot.hpp"

#include <filesystem>
#include <system_error>

#include <fmt/format.h>

namespace waymark::cli {

Status become_the_robot(Stage& stage, const std::string& words, const SimulatedTime& time) {
  std::error_code error;
  const std::string self = std::filesystem::read_symlink("/proc/self/exe", error).string();
  if (error)
    return fail(ErrorCode::Unsupported, "this program does not know its own name: " + error.message());
  stage.process = fmt::format("exec '{}' robot-sim {}{}", self, words, time.lockstep ? " --lockstep" : "");
  if (time.lockstep && time.pace > 0) stage.process += fmt::format(" --pace {}", time.pace);
  return {};
}

}  // namespace waymark::cli
