#pragma once

#include <optional>

#include "waymark/base/error.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// Accuracy of a replay relative to the taught lap, from ground truth alone, without the robot's estimate.
struct ReplayJudgement {
  /// Distance of the base from the taught path in the plane, averaged over the distance driven. A pose counts
  /// once the robot has moved by 1 cm, so a standstill counts once.
  double cross_track_rmse_m = 0;
  double cross_track_p95_m = 0;
  double cross_track_max_m = 0;
  double heading_rmse_deg = 0;       ///< relative to the taught heading at the foot point
  double min_clearance_m = 0;        ///< hull to the nearest true tag, in space; infinite without tags
  double distance_m = 0;             ///< distance driven
  double progress_m = 0;             ///< distance along the taught path
  std::optional<double> lap_m = {};  ///< length of the taught lap; none if it did not return to its start
  double laps = 0;                   ///< progress_m over lap_m, or over the length of an open path
  int laps_completed = 0;            ///< complete laps; up to 0.25 m may be missing
};

/// Compares the true base path of a replay with that of the teach lap. Both must be in time order. A taught
/// lap may continue beyond its start; either pass is then accepted there. Fails if one of them is shorter
/// than 0.5 m. O(replay poses + taught poses), except for a search of the whole lap at the start of the
/// replay.
[[nodiscard]] Result<ReplayJudgement> judge_replay(const Trajectory& replayed, const Trajectory& taught,
                                                   const TagMap& true_tags, const Hull& hull);

}  // namespace waymark
