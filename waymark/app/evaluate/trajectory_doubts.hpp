#pragma once

#include <string>
#include <vector>

#include "waymark/app/evaluate/evaluate_trajectory.hpp"

namespace waymark {

/// What makes a comparison doubtful, in words: hardly a moment in common, two drives (both recordings say how
/// the wheels turned, and not the same), two places. Empty when there is nothing to say. Reads the odometry
/// of both files again where they are recordings.
[[nodiscard]] std::vector<std::string> doubts_about(const TrajectoryReport& report,
                                                    const Reference& reference,
                                                    const JobControl& control = {});

}  // namespace waymark
