#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/localization/riekf.hpp"

namespace waymark {

/// The key motion of a robot's file (docs/formats/robot.md): how far its odometry may be from the truth, in
/// fields of MotionNoise. Nothing when the file does not say it. Errors have file, line and key.
[[nodiscard]] Result<std::optional<MotionNoise>> read_robot_motion(const std::filesystem::path& path);
[[nodiscard]] Result<std::optional<MotionNoise>> parse_robot_motion(std::string_view text,
                                                                    const std::string& source);

}  // namespace waymark
