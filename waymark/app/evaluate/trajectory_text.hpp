#pragma once

#include <string>

#include "waymark/app/evaluate/evaluate_trajectory.hpp"

namespace waymark {

/// A table: a row a trajectory, then words about consistency, jumps and cover.
[[nodiscard]] std::string to_text(const TrajectoryReport& report);

}  // namespace waymark
