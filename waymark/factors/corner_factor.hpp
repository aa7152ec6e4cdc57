#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {

/// The four corners of one tag in an image from one camera.
struct CornerFactor {
  std::array<Eigen::Vector2d, 4> corners_px{};  ///< TL, TR, BR, BL; distorted, with pixel centres at +1/2
  double size_m = 0;  ///< side of the square where the black border meets the white border
  /// L^-1 of the corners' covariance L L^T [1/px], which whitens the residual.
  CornerCovariance whitening = CornerCovariance::Identity();
  bool isotropic = false;  ///< the whitening is a multiple of the identity, which saves operations
};

/// Makes a factor from a detection, with `default_sigma_px` if the detection has no covariance. Fails on
/// unreliable or non-finite corners, a size that is not positive, or a covariance that is not positive
/// definite.
[[nodiscard]] Result<CornerFactor> corner_factor(const TagDetection& detection, double size_m,
                                                 double default_sigma_px);

/// The poses between a camera and a tag: cam_T_tag = (map_T_rig rig_T_cam)^-1 map_T_body body_T_tag. For a
/// camera on a robot, the rig is the base; for a tag on a wall, map_T_body is the identity.
struct CornerPoses {
  SE3 map_T_rig{};
  SE3 rig_T_cam{};
  SE3 map_T_body{};
  SE3 body_T_tag{};
  double size_scale = 1;  ///< actual side of the tag over that in CornerFactor
};

/// Jacobians J_r_X (8x6) of the whitened residual for a left perturbation of each requested pose, and
/// J_r_size for log(size_scale).
struct CornerJacobians {
  bool wants_rig = true, wants_cam = true, wants_body = true, wants_tag = true, wants_size = false;
  Eigen::Matrix<double, 8, 6> rig;
  Eigen::Matrix<double, 8, 6> cam;
  Eigen::Matrix<double, 8, 6> body;
  Eigen::Matrix<double, 8, 6> tag;
  Eigen::Matrix<double, 8, 1> size;
};

/// Whitened residual, projected minus measured; in the order TL x, TL y, TR x, TR y, and so on. Empty (and J
/// is incomplete) if a corner is behind the camera or beyond the lens. Does not allocate.
[[nodiscard]] std::optional<Eigen::Matrix<double, 8, 1>> corner_residual(const CornerFactor& factor,
                                                                         const CameraModel& camera,
                                                                         const CornerPoses& poses,
                                                                         CornerJacobians* J = nullptr);

/// Jacobian J_r_intrinsics (8 x n) of the whitened residual of corner_residual().
using CornerIntrinsicsJacobian = Eigen::Matrix<double, 8, Eigen::Dynamic, Eigen::ColMajor, 8, kMaxIntrinsics>;

/// Empty if a corner is behind the camera or beyond the lens. Does not allocate.
[[nodiscard]] std::optional<CornerIntrinsicsJacobian> corner_intrinsics_jacobian(const CornerFactor& factor,
                                                                                 const CameraModel& camera,
                                                                                 const CornerPoses& poses);

}  // namespace waymark
