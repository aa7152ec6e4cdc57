#pragma once

#include <optional>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// An estimate and the reference at the same time.
struct PosePair {
  EstimatedPose estimated{};
  SE3 reference{};  ///< ref_T_base
};

/// The pose of the base at `stamp`, interpolated linearly between the two neighbouring poses. `nullopt`
/// outside the time span of the trajectory, or if the two poses are further apart than `max_gap`. O(log
/// poses).
[[nodiscard]] std::optional<SE3> pose_at(const Trajectory& trajectory, SensorTime stamp, Duration max_gap);

/// Pairs each estimate with the reference at the same time; estimates without a reference are skipped. Both
/// inputs must be in time order.
[[nodiscard]] std::vector<PosePair> pair_by_time(const EstimatedTrajectory& estimated,
                                                 const Trajectory& reference, Duration max_gap);

}  // namespace waymark
