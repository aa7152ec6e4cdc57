#pragma once

#include <optional>

#include "waymark/base/error.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// Accuracy of a replay relative to the taught lap, computed from ground truth alone, without the robot's own
/// estimate.
struct ReplayJudgement {
  /// Distance in the plane between the base and the taught path, averaged over the distance driven. A pose
  /// counts only after the robot has moved by 1 cm, so a standstill counts once.
  double cross_track_rmse_m = 0;
  double cross_track_p95_m = 0;
  double cross_track_max_m = 0;
  double heading_rmse_deg = 0;       ///< relative to the taught heading at the foot point
  double min_clearance_m = 0;        ///< from the hull to the nearest true tag, in 3D; infinite without tags
  double distance_m = 0;             ///< distance driven
  double progress_m = 0;             ///< distance along the taught path
  std::optional<double> lap_m = {};  ///< length of the taught lap; `nullopt` if it did not close
  double laps = 0;                   ///< ratio of progress_m to lap_m, or to the length of an open path
  int laps_completed = 0;            ///< number of complete laps; up to 0.25 m may be missing
};

/// Compares the true path of the base during a replay with that during the teach lap. Both must be in time
/// order. A taught lap may continue past its start; either pass is then accepted there. Fails if either
/// trajectory is shorter than 0.5 m. O(replay poses + taught poses), plus a search of the whole lap at the
/// start of the replay.
[[nodiscard]] Result<ReplayJudgement> judge_replay(const Trajectory& replayed, const Trajectory& taught,
                                                   const TagMap& true_tags, const Hull& hull);

}  // namespace waymark
