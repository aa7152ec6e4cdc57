#pragma once

#include <string>
#include <vector>

#include "waymark/cli/trajectory_report.hpp"

namespace waymark::cli {

/// What makes a comparison doubtful, in words: hardly a moment in common, two drives (both recordings say how
/// the wheels turned, and not the same), two places. Empty when there is nothing to say. Reads the odometry
/// of both files again where they are recordings.
[[nodiscard]] std::vector<std::string> doubts_about(const TrajectoryReport& report,
                                                    const Reference& reference);

}  // namespace waymark::cli
