#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "waymark/app/live/robot_setup.hpp"

namespace waymark {

/// In what `now` differs from `taught`, of that which a replay rests on: "hull", "wheels", "camera",
/// "camera mounting by 0.030 m and 2.0 deg". Lengths that agree within 1 mm, angles within 0.1 deg and focal
/// lengths within 1 % are the same.
[[nodiscard]] std::vector<std::string> robot_differences(const RobotDescription& taught,
                                                         const RobotDescription& now);

/// What to say before a replay: that the robot of the setup is not that of robot.yaml in the folder of the
/// map, or that robot.yaml describes another robot than `robot` names by itself. Empty: they agree, or there
/// is nothing to compare.
[[nodiscard]] std::vector<std::string> other_robot_words(const RobotSetup& setup,
                                                         const std::filesystem::path& map_folder);

}  // namespace waymark
