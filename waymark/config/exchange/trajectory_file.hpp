#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// A trajectory as TUM text ("RGB-D SLAM Dataset and Benchmark", file formats): one line a pose, `stamp_s x y
/// z qx qy qz qw`, map_T_base; lines that begin with # are passed over. Stamps have nine decimals: nothing of
/// a nanosecond is lost. Errors have file and line: not eight numbers, a quaternion that is none, stamps that
/// do not grow.
[[nodiscard]] Result<Trajectory> read_trajectory(const std::filesystem::path& path);
[[nodiscard]] Result<Trajectory> parse_trajectory(std::string_view text, const std::string& source);

[[nodiscard]] std::string to_tum(const Trajectory& trajectory);

}  // namespace waymark
