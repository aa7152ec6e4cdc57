#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/samples/calibration.hpp"
#include "waymark/samples/robot_model.hpp"

namespace waymark {

/// Valid names in `values`, in the order used in the file.
[[nodiscard]] const std::vector<std::string>& calibration_names();

/// Reads calibration.yaml (docs/formats/calibration.md). Fails with file, line and key on a file of another
/// kind, an unknown or missing key, a negative standard deviation, an unknown verdict, or parameters that
/// CameraModel::make() rejects. Also fails on correlations that do not belong to the camera or are not
/// positive semidefinite.
[[nodiscard]] Result<Calibration> read_calibration(const std::filesystem::path& path);
[[nodiscard]] Result<Calibration> parse_calibration(std::string_view text, const std::string& source);

/// The text reads back as exactly the same calibration.
[[nodiscard]] std::string to_yaml(const Calibration& calibration);
/// Fails if the path is an existing file that is not a calibration.
[[nodiscard]] Status check_calibration_place(const std::filesystem::path& path);
/// Fails (InvalidArgument) without writing on a non-finite number, an unknown name, or correlations with
/// another size than the camera has parameters. Also fails if the path
/// is an existing file that is not a calibration.
[[nodiscard]] Status write_calibration(const std::filesystem::path& path, const Calibration& calibration);

/// Standard deviations of a camera's parameters, in the order of intrinsics_of(). A parameter without one
/// gets a value close to zero. Empty if the calibration contains none of them.
[[nodiscard]] Eigen::VectorXd intrinsics_sigma(const CameraModel& camera, const Calibration& calibration);
/// Covariance of a camera's parameters, from their standard deviations and Calibration::camera_correlations.
/// Empty if the calibration contains no standard deviation of them. Without correlations, they are taken as
/// independent.
[[nodiscard]] IntrinsicsCovariance intrinsics_covariance(const CameraModel& camera,
                                                         const Calibration& calibration);

/// base_T_cam with the calibrated components of the mounting replaced.
[[nodiscard]] SE3 calibrated_mounting(const SE3& base_T_cam, const Calibration& calibration);

}  // namespace waymark
