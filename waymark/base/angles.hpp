#pragma once

#include <numbers>

namespace waymark {

/// Input and output use degrees, computations use radians (docs/conventions.md, Units).
[[nodiscard]] constexpr double to_degrees(double angle_rad) { return angle_rad * 180 / std::numbers::pi; }
[[nodiscard]] constexpr double to_radians(double angle_deg) { return angle_deg * std::numbers::pi / 180; }

}  // namespace waymark
