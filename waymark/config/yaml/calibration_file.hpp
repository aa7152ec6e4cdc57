#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/samples/calibration.hpp"
#include "waymark/samples/robot_model.hpp"

namespace waymark {

/// The names that `values` may have, in the order of the file.
[[nodiscard]] const std::vector<std::string>& calibration_names();

/// calibration.yaml (docs/formats/calibration.md). Errors have file, line and key: not a calibration, an
/// unknown or missing key, a standard deviation below 0, a verdict that is none, what CameraModel::make()
/// refuses.
[[nodiscard]] Result<Calibration> read_calibration(const std::filesystem::path& path);
[[nodiscard]] Result<Calibration> parse_calibration(std::string_view text, const std::string& source);

/// Reads back as the same calibration, to the last bit.
[[nodiscard]] std::string to_yaml(const Calibration& calibration);
/// Fails where a file stands that is no calibration.
[[nodiscard]] Status check_calibration_place(const std::filesystem::path& path);
/// Fails (InvalidArgument) on a number that is not finite and a name that is none, instead of writing it,
/// and where a file stands that is no calibration.
[[nodiscard]] Status write_calibration(const std::filesystem::path& path, const Calibration& calibration);

/// Standard deviations of a camera's numbers in the order of intrinsics_of(), those that are not known next
/// to nothing; empty where the calibration has none of them. Correlations are not kept in the file.
[[nodiscard]] Eigen::VectorXd intrinsics_sigma(const CameraModel& camera, const Calibration& calibration);

/// base_T_cam with the known parts of the mounting put in place of those of `base_T_cam`.
[[nodiscard]] SE3 calibrated_mounting(const SE3& base_T_cam, const Calibration& calibration);

}  // namespace waymark
