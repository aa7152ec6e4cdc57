#pragma once

#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"

/// What corners err by beyond their covariances.
namespace waymark {

/// The tags of one picture that a pose rests on, and that pose.
struct PosedTags {
  std::vector<TagDetection> detections{};
  SE3 cam_T_map{};
};

/// A standard deviation that all corner coordinates of these pictures have besides their covariances
/// [px]: what a video's compression, the lens, the print of the tags and the map do to them, which their
/// detector cannot see. Taken as independent and alike; such that the sum of the squared normalised residuals
/// is as large as it should be (method of moments). 0 where it is without it, or where fewer than 20
/// residuals are left over. O(tags).
[[nodiscard]] double common_corner_error_px(const std::vector<PosedTags>& pictures, const TagMap& map,
                                            const CameraModel& camera);

/// The tags of a picture with such an error in their covariances.
[[nodiscard]] TagFrame with_corner_error(TagFrame frame, double sigma_px);

}  // namespace waymark
