#pragma once

#include <vector>

#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

/// How far an estimated map and trajectory are from the truth, in the frame both claim to be in: anchored,
/// nothing is aligned.
namespace waymark {

struct TagMapErrors {
  std::size_t tags = 0;             ///< in both maps: the figures are over these
  double rmse_m = 0;                ///< root mean square distance of the centres
  double max_m = 0;                 ///< largest of them
  double orientation_rmse_deg = 0;  ///< root mean square angle of map_R_tag from the true one
  std::vector<TagId> missing{};     ///< in the truth only
  std::vector<TagId> unknown{};     ///< in the estimate only
};

/// All figures are 0 when no tag is in both. O(tags).
[[nodiscard]] TagMapErrors tag_map_errors(const TagMap& estimated, const TagMap& truth);

struct TrajectoryErrors {
  std::size_t poses = 0;  ///< estimated poses within the time of the truth: the figures are over these
  double rmse_m = 0;      ///< root mean square distance of the base
  double max_m = 0;       ///< largest of them
  double orientation_rmse_deg = 0;
};

/// Each estimated pose against the truth at its stamp, interpolated between the two true poses about it
/// (straight line, shortest turn). Both in order of time. O(poses).
[[nodiscard]] TrajectoryErrors trajectory_errors(const Trajectory& estimated, const Trajectory& truth);

/// Whether the anchor of a map stands where the truth has it, but for the error of a measured lean or place
/// (2 cm, 0.02 rad): only then do errors without alignment mean anything.
[[nodiscard]] bool in_frame_of_truth(const SE3& map_T_anchor, const SE3& true_map_T_anchor);

}  // namespace waymark
