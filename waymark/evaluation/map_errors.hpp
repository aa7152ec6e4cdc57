#pragma once

#include <map>
#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

/// Errors of an estimated map and trajectory in the anchored frame shared with the ground truth, without
/// alignment.
namespace waymark {

struct TagMapErrors {
  std::size_t tags = 0;             ///< number of tags in both maps, to which the other values refer
  double rmse_m = 0;                ///< root mean square distance between tag centres
  double max_m = 0;                 ///< largest distance between tag centres
  double orientation_rmse_deg = 0;  ///< root mean square angle between estimated and true map_R_tag
  std::vector<TagId> missing{};     ///< tags only in the ground truth
  std::vector<TagId> unknown{};     ///< tags only in the estimate
};

/// All values are 0 if the maps have no tag in common. O(tags).
[[nodiscard]] TagMapErrors tag_map_errors(const TagMap& estimated, const TagMap& truth);

struct TrajectoryErrors {
  std::size_t poses = 0;  ///< number of estimated poses within the time span of the ground truth, to which
                          ///< the other values refer
  double rmse_m = 0;      ///< root mean square position error of the base
  double max_m = 0;       ///< largest position error
  double orientation_rmse_deg = 0;
};

/// Compares each estimated pose with the ground truth at the same time, interpolated linearly between the two
/// neighbouring poses. Both inputs must be in time order. O(poses).
[[nodiscard]] TrajectoryErrors trajectory_errors(const Trajectory& estimated, const Trajectory& truth);

/// Whether the anchor of a map is at its true pose, to within the error of a measured tilt or position (2 cm,
/// 0.02 rad). If not, errors without alignment are meaningless.
[[nodiscard]] bool in_frame_of_truth(const SE3& map_T_anchor, const SE3& true_map_T_anchor);

/// Reprojection errors of one tag for a given map and trajectory.
struct TagReprojection {
  std::size_t observations = 0;
  double rms_px = 0;                                  ///< over both coordinates of all corners
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();  ///< mean of observed minus predicted corners
  double largest_px = 0;                              ///< largest error of a single corner
  double nearest_m = 0;                               ///< smallest distance from the camera to the tag centre
  double farthest_m = 0;
};

/// Predicts every observation of a map tag from the pose of the trajectory at the time of its frame. Frames
/// outside the time span of the trajectory, tags that are not in the map and corners that cannot be visible
/// are skipped. O(observations log poses).
[[nodiscard]] std::map<TagId, TagReprojection> tag_reprojection(const std::vector<TagFrame>& frames,
                                                                const TagMap& map,
                                                                const Trajectory& trajectory,
                                                                const CameraModel& camera,
                                                                const SE3& base_T_cam);

}  // namespace waymark
