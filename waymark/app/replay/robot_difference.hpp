#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "waymark/app/live/robot_setup.hpp"

namespace waymark {

/// The properties that affect a replay and differ between the two robots: "hull", "wheels", "camera", "camera
/// mounting by 0.030 m and 2.0 deg". Tolerances: lengths 1 mm, angles 0.1 deg, focal lengths 1 %.
[[nodiscard]] std::vector<std::string> robot_differences(const RobotDescription& taught,
                                                         const RobotDescription& now);

/// Warnings before a replay: the robot of the setup differs from robot.yaml in the map folder, or robot.yaml
/// describes another robot than the default file of `robot`. Empty if they agree, or there is nothing to
/// compare.
[[nodiscard]] std::vector<std::string> robot_difference_warnings(const RobotSetup& setup,
                                                                 const std::filesystem::path& map_folder);

}  // namespace waymark
