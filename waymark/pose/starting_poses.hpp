#pragma once

#include <array>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/pose/reprojection.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark::internal {

/// Both closed-form poses of a detected tag (square_poses), or in words why it is no image of a square: size
/// not positive and finite, corners not finite, beyond the lens, repeated, on a line, mirrored or out of
/// order.
Result<std::array<SE3, 2>> starting_poses(const TagDetection& detection, double size_m,
                                          const CameraModel& camera);

/// From the detection's covariance, or from sigma_px when it has none; fails when that is not finite and
/// positive definite.
Result<Whitening> whitening_of(const TagDetection& detection, double sigma_px);

}  // namespace waymark::internal
