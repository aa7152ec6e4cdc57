#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"

namespace waymark {

/// Largest number of parameters of a camera model.
inline constexpr int kMaxIntrinsics = 12;
/// J_px_intrinsics, one column per parameter.
using IntrinsicsJacobian = Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, kMaxIntrinsics>;

/// The parameters of a camera: fx, fy, cx, cy, then the distortion coefficients in use in the order of the
/// model.
[[nodiscard]] Eigen::VectorXd intrinsics_of(const CameraModel& camera);
/// Their names: "fx", "fy", "cx", "cy", "k1", …
[[nodiscard]] std::vector<std::string> intrinsics_names(const CameraModel& camera);
/// The same kind of camera with other parameters, as many as intrinsics_of() returns. Fails as
/// CameraModel::make() does.
[[nodiscard]] Result<CameraModel> with_intrinsics(const CameraModel& camera,
                                                  const Eigen::VectorXd& intrinsics);

/// Derivative of the pixel of a point with respect to the parameters; nothing if project() returns nothing.
[[nodiscard]] std::optional<IntrinsicsJacobian> intrinsics_jacobian(const CameraModel& camera,
                                                                    const Eigen::Vector3d& cam_p);

}  // namespace waymark
