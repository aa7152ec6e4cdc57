#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

/// Observations in one image of a calibration, and their reprojection errors.
struct CameraObservation {
  std::string picture{};
  SE3 cam_T_target{};
  std::vector<Eigen::Vector3d> target_points_m{};
  std::vector<Eigen::Vector2d> seen_px{};  ///< same size; pixel centres at +1/2
  std::vector<Eigen::Vector2d>
      errors_px{};           ///< same size: projected minus observed; non-finite if not projectable
  std::vector<bool> used{};  ///< same size
};

/// A calibrated camera from a file. Intrinsics have pixel centres at +1/2. The files below have centres at
/// integers, so 1/2 is added to c_x and c_y on reading and subtracted on writing.
struct NamedCamera {
  std::string name;  ///< camera_name of ROS, key of the camchain ("cam0")
  CameraModel camera;
  std::string topic = {};                         ///< rostopic of the camchain; empty if not given
  std::optional<Eigen::Matrix4d> cam_T_imu = {};  ///< T_cam_imu of the camchain
  std::optional<Eigen::Matrix4d> cam_T_previous =
      {};  ///< T_cn_cnm1: from the camera before this one in the chain
  std::optional<double> imu_minus_cam_time_s = {};  ///< timeshift_cam_imu: t_imu = t_cam + shift

  friend bool operator==(const NamedCamera&, const NamedCamera&) = default;
};

/// Reads all cameras of a calibration file, at least one. The format is recognised by its content:
///
/// - ROS camera_info YAML (image_width, camera_matrix, distortion_model plumb_bob | rational_polynomial |
///   equidistant | fisheye; rectification and projection are checked but not used, because images are
///   processed unrectified);
/// - kalibr camchain (cam0: camera_model pinhole, distortion_model radtan | equidistant | none), also as
/// TagSLAM writes it;
/// - Waymark's robot.yaml or calibration.yaml (its camera_info);
/// - a calibration of PhotonVision (JSON; its observations are skipped);
/// - OpenCV's YAML (FileStorage: camera_matrix, distortion_coefficients, image_width, image_height;
///   fisheye_model not 0 for the equidistant lens).
///
/// Errors have file, line and key: not a camera file, an unknown key or model (with the nearest known one), a
/// missing value, inconsistent values, parameters that CameraModel::make() rejects.
[[nodiscard]] Result<std::vector<NamedCamera>> read_cameras(const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<NamedCamera>> parse_cameras(std::string_view text,
                                                             const std::string& source);

/// Reads one camera. Without a name the file must contain exactly one; the error lists the names. Only the
/// chosen camera of a camchain must be valid.
[[nodiscard]] Result<NamedCamera> read_camera(const std::filesystem::path& path, std::string_view name = {});
[[nodiscard]] Result<NamedCamera> parse_camera(std::string_view text, const std::string& source,
                                               std::string_view name = {});

/// Writes the camera as ROS camera_info YAML, without rectification (R = identity, P = [K 0]). Topic,
/// transforms and time shift are not written. Reads back as exactly the same intrinsics.
[[nodiscard]] std::string to_camera_info_yaml(const NamedCamera& camera);

/// Writes the cameras as a kalibr camchain. Fails (Unsupported) for the rational model, which kalibr lacks.
[[nodiscard]] Result<std::string> to_camchain_yaml(const std::vector<NamedCamera>& cameras);

/// Writes the camera as YAML of OpenCV's FileStorage, with the keys of OpenCV's calibration program
/// (camera_matrix, distortion_coefficients, image_width, image_height; fisheye_model for the equidistant
/// lens). Reads back as exactly the same intrinsics; a lens without coefficients gets five zeros.
[[nodiscard]] std::string to_opencv_yaml(const NamedCamera& camera);

/// Writes the camera as a calibration of PhotonVision, with its observations. Fails (Unsupported) for the
/// equidistant lens, which PhotonVision lacks. Reads back as to_opencv_yaml() does.
[[nodiscard]] Result<std::string> to_photonvision_json(
    const NamedCamera& camera, const std::vector<CameraObservation>& observations = {});

}  // namespace waymark
