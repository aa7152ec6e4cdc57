#pragma once

#include <optional>
#include <vector>

#include "waymark/pose/tag_pose.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A tag as one frame saw it.
struct TagPoseObservation {
  TagId tag{};
  SE3 cam_T_tag{};             ///< the better of its two poses
  double ambiguity_ratio = 0;  ///< of TagPose: near 1 the other pose fits as well
  /// Of cam_T_tag; zeros: not known, all observations count the same.
  PoseCovariance covariance = PoseCovariance::Zero();
  double chi2 = 0;                            ///< of the better pose
  std::optional<TagPoseSolution> other = {};  ///< the other pose
};

/// What one frame saw.
struct ObservedFrame {
  SensorTime stamp{};
  std::optional<SE3> base_T_cam{};  ///< of the camera that saw it; nothing: of the robot's first
  std::vector<TagPoseObservation> tags{};
};

}  // namespace waymark
