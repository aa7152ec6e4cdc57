#pragma once

#include <optional>

#include <Eigen/Core>

#include "waymark/camera/intrinsics.hpp"
#include "waymark/factors/corner_factor.hpp"

namespace waymark {

/// J_r_intrinsics (8 x n) of the whitened residual of corner_residual().
using CornerIntrinsicsJacobian =
    Eigen::Matrix<double, 8, Eigen::Dynamic, Eigen::ColMajor, 8, kMostIntrinsics>;

/// Nothing when a corner is behind the camera or beyond the lens. No allocation.
[[nodiscard]] std::optional<CornerIntrinsicsJacobian> corner_intrinsics_jacobian(const CornerFactor& factor,
                                                                                 const CameraModel& camera,
                                                                                 const CornerPoses& poses);

}  // namespace waymark
