#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// Reads a trajectory in TUM format ("RGB-D SLAM Dataset and Benchmark", file formats): one pose per line,
/// `stamp_s x y z qx qy qz qw`, map_T_base. Lines that begin with # are ignored. Stamps are exact to the
/// nanosecond. Fails with file and line if a line does not contain eight numbers, a quaternion is invalid, or
/// stamps do not increase.
[[nodiscard]] Result<Trajectory> read_trajectory(const std::filesystem::path& path);
[[nodiscard]] Result<Trajectory> parse_trajectory(std::string_view text, const std::string& source);

[[nodiscard]] std::string to_tum(const Trajectory& trajectory);

}  // namespace waymark
