#pragma once

#include <filesystem>
#include <optional>

#include "waymark/base/error.hpp"
#include "waymark/localization/riekf_options.hpp"

namespace waymark {

/// The key motion of a robot's file (docs/formats/robot.md): how far its odometry may be from the truth, in
/// fields of MotionNoise. Nothing when the file does not say it. Errors have file, line and key.
[[nodiscard]] Result<std::optional<MotionNoise>> read_robot_motion(const std::filesystem::path& path);

}  // namespace waymark
