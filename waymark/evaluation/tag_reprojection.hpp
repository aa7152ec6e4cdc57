#pragma once

#include <map>
#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

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
