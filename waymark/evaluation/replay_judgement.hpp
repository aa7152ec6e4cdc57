#pragma once

#include <optional>

#include "waymark/base/error.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// How well a replay repeated what was taught, by truth alone: the estimate of the robot itself does not
/// count.
struct ReplayJudgement {
  /// Distance of the replay's base from the taught path, in the plane, over the way (a pose counts once the
  /// robot is a centimetre further: standing still counts once).
  double cross_track_rmse_m = 0;
  double cross_track_p95_m = 0;
  double cross_track_max_m = 0;
  double heading_rmse_deg = 0;  ///< against the taught robot's heading at the foot point
  double min_clearance_m = 0;   ///< hull to the nearest true tag, in space; infinite without tags
  double distance_m = 0;        ///< driven
  double progress_m = 0;        ///< along the taught path
  std::optional<double> lap_m =
      {};                  ///< length of the taught lap; nothing when it did not come back to its start
  double laps = 0;         ///< progress_m over lap_m, or over the length of an open path
  int laps_completed = 0;  ///< whole ones; a quarter of a metre may be missing
};

/// Judges the true base path of a replay against the true base path of the teach lap. Both in order of time;
/// a taught lap may go on beyond its start, and then either pass is right there. Fails when one of them is
/// shorter than half a metre. O(replay poses + taught poses), but for a search of the whole lap where the
/// replay begins.
[[nodiscard]] Result<ReplayJudgement> judge_replay(const Trajectory& replayed, const Trajectory& taught,
                                                   const TagMap& true_tags, const Hull& hull);

}  // namespace waymark
