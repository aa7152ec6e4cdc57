#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"

namespace waymark {

/// The largest number of parameters of any camera model.
inline constexpr int kMaxIntrinsics = 12;
/// J_px_intrinsics, one column per parameter.
using IntrinsicsJacobian = Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, kMaxIntrinsics>;

/// Covariance of the parameters, in the order of intrinsics_of().
using IntrinsicsCovariance =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxIntrinsics, kMaxIntrinsics>;

/// The parameters of a camera: fx, fy, cx, cy, then the distortion coefficients in use, in the order of the
/// model. The skew is not included, because no calibration here estimates it.
[[nodiscard]] Eigen::VectorXd intrinsics_of(const CameraModel& camera);
/// Names of the parameters: "fx", "fy", "cx", "cy", "k1", …
[[nodiscard]] std::vector<std::string> intrinsics_names(const CameraModel& camera);
/// The same kind of camera with different parameters, as many as intrinsics_of() returns. Fails in the same
/// cases as CameraModel::make().
[[nodiscard]] Result<CameraModel> with_intrinsics(const CameraModel& camera,
                                                  const Eigen::VectorXd& intrinsics);

/// Whether a matrix can be a covariance: finite, symmetric, and positive semidefinite up to rounding errors.
[[nodiscard]] bool is_covariance(const IntrinsicsCovariance& covariance);

/// Derivative of a point's pixel with respect to the parameters; `nullopt` if project() returns `nullopt`.
[[nodiscard]] std::optional<IntrinsicsJacobian> intrinsics_jacobian(const CameraModel& camera,
                                                                    const Eigen::Vector3d& cam_p);

}  // namespace waymark
