#pragma once

#include <optional>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// An estimate and where the reference was at that moment.
struct PosePair {
  EstimatedPose estimated{};
  SE3 reference{};  ///< ref_T_base
};

/// Where the base was at `stamp`: between the two poses about it, straight line and shortest turn. Nothing
/// outside the trajectory, and where the two are further apart than `max_gap`. O(log poses).
[[nodiscard]] std::optional<SE3> pose_at(const Trajectory& trajectory, SensorTime stamp, Duration max_gap);

/// Each estimate with the reference at its stamp; those without one are left out. Both in order of time.
[[nodiscard]] std::vector<PosePair> pair_by_time(const EstimatedTrajectory& estimated,
                                                 const Trajectory& reference, Duration max_gap);

}  // namespace waymark
