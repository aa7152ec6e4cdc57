#pragma once

#include <map>
#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_samples.hpp"
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

/// How well a map and a trajectory explain the corners of one tag.
struct TagReprojection {
  std::size_t observations = 0;
  double rms_px = 0;                                  ///< over both coordinates of all corners
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();  ///< of seen less predicted corners
  double largest_px = 0;                              ///< distance of the worst corner
  double nearest_m = 0;                               ///< from camera to the tag's centre
  double farthest_m = 0;
};

/// Every observation of a mapped tag, predicted from the pose of the trajectory at the time of its frame.
/// Frames outside the trajectory, tags not in the map and corners that the camera cannot have seen are left
/// out. O(observations log poses).
[[nodiscard]] std::map<TagId, TagReprojection> tag_reprojection(const std::vector<TagFrame>& frames,
                                                                const TagMap& map,
                                                                const Trajectory& trajectory,
                                                                const CameraModel& camera,
                                                                const SE3& base_T_cam);

}  // namespace waymark
