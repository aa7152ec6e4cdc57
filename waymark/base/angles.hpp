#pragma once

#include <numbers>

namespace waymark {

/// Degrees are used for input and output, radians for computations (docs/conventions.md, Units).
[[nodiscard]] constexpr double to_degrees(double angle_rad) { return angle_rad * 180 / std::numbers::pi; }
[[nodiscard]] constexpr double to_radians(double angle_deg) { return angle_deg * std::numbers::pi / 180; }

}  // namespace waymark
