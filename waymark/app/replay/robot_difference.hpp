#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "waymark/app/live/robot_setup.hpp"

namespace waymark {

/// The properties that affect a replay and differ between the two robots: "hull", "wheels", "camera", "camera
/// mounting by 0.030 m and 2.0 deg". Tolerances are 1 mm for lengths, 0.1 deg for angles and 1 % for focal
/// lengths.
[[nodiscard]] std::vector<std::string> robot_differences(const RobotDescription& taught,
                                                         const RobotDescription& now);

/// Warnings for the user before a replay. They report that the robot of the setup differs from robot.yaml in
/// the map folder, or that the default file for `robot` describes a different robot than robot.yaml does.
/// Empty if they agree or there is nothing to compare.
[[nodiscard]] std::vector<std::string> robot_difference_warnings(const RobotSetup& setup,
                                                                 const std::filesystem::path& map_folder);

}  // namespace waymark
