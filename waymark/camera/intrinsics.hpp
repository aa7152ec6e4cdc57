#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"

namespace waymark {

/// A camera model has at most so many numbers.
inline constexpr int kMaxIntrinsics = 12;
/// J_px_intrinsics, one column for each number.
using IntrinsicsJacobian = Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, kMaxIntrinsics>;

/// The numbers of a camera: fx, fy, cx, cy, then the distortion coefficients in use in the order of its
/// model.
[[nodiscard]] Eigen::VectorXd intrinsics_of(const CameraModel& camera);
/// Their names: "fx", "fy", "cx", "cy", "k1", …
[[nodiscard]] std::vector<std::string> intrinsics_names(const CameraModel& camera);
/// The same kind of camera with other numbers, as many as intrinsics_of() gives. Fails on what
/// CameraModel::make() refuses.
[[nodiscard]] Result<CameraModel> with_intrinsics(const CameraModel& camera,
                                                  const Eigen::VectorXd& intrinsics);

/// How the pixel of a point moves with the camera's numbers; nothing where project() gives nothing.
[[nodiscard]] std::optional<IntrinsicsJacobian> intrinsics_jacobian(const CameraModel& camera,
                                                                    const Eigen::Vector3d& cam_p);

}  // namespace waymark
