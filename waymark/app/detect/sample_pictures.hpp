#pragma once

#include <cstdint>
#include <filesystem>

#include "waymark/base/error.hpp"

namespace waymark {

/// Board of write_board_pictures(), as `waymark calibrate camera` is told.
inline constexpr int kSampleBoardColumns = 6;
inline constexpr int kSampleBoardRows = 5;
inline constexpr double kSampleBoardTag_m = 0.03;
/// Side of the tags of write_tag_pictures().
inline constexpr double kSampleTag_m = 0.16;

/// Six photographs of three tags each, 1.png to 6.png, and truth.json: for each picture its tags with their
/// corners [px] and their poses in the camera frame [m, quaternion x y z w]. camera.yaml is the lens.
[[nodiscard]] Status write_tag_pictures(const std::filesystem::path& folder, std::uint64_t seed);

/// Fifteen photographs of a board of 6 x 5 tags, 01.png to 15.png, by the lens of camera.yaml.
[[nodiscard]] Status write_board_pictures(const std::filesystem::path& folder, std::uint64_t seed);

}  // namespace waymark
