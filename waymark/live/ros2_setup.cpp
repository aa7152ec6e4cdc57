#include "waymark/live/ros2_setup.hpp"

#include <filesystem>
#include <system_error>

#include "waymark/drivers/ros2/profile.hpp"

namespace waymark {

Result<RobotSetup> load_ros2_setup(const std::string& profile, const std::string& world,
                                   const std::string& robot_file, std::uint64_t seed) {
  const auto found = find_ros2_profile(profile);
  if (!found) return tl::unexpected(found.error());
  const std::string file = robot_file.empty() ? found->robot : robot_file;
  auto setup = load_setup(world, file, seed);
  if (!setup) return setup;
  std::error_code error;
  const std::string self = std::filesystem::read_symlink("/proc/self/exe", error).string();
  if (error)
    return fail(ErrorCode::Unsupported, "this program does not know its own name: " + error.message());
  setup->process =
      RobotCommand(std::vector<std::string>{self, "ros2", "robot", profile, "--robot-file", file});
  return setup;
}

}  // namespace waymark
