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

/// The observations in one image of a calibration, and their reprojection errors.
struct CameraObservation {
  std::string image{};
  SE3 cam_T_target{};
  std::vector<Eigen::Vector3d> target_points_m{};
  std::vector<Eigen::Vector2d> seen_px{};    ///< one per target point; pixel centres at +1/2
  std::vector<Eigen::Vector2d> errors_px{};  ///< one per target point: projected minus observed; non-finite
                                             ///< if the point cannot be projected
  std::vector<bool> used{};                  ///< one per target point
};

/// A calibrated camera from a file. Intrinsics have pixel centres at +1/2. The file formats below have pixel
/// centres at integers, so 1/2 is added to c_x and c_y on reading and subtracted on writing.
struct NamedCamera {
  std::string name;  ///< camera_name in ROS files, or the key in a camchain ("cam0")
  CameraModel camera;
  std::string topic = {};                         ///< rostopic in a camchain; empty if not given
  std::optional<Eigen::Matrix4d> cam_T_imu = {};  ///< T_cam_imu in a camchain
  std::optional<Eigen::Matrix4d> cam_T_previous =
      {};  ///< T_cn_cnm1: transform from the previous camera in the chain
  std::optional<double> imu_minus_cam_time_s = {};  ///< timeshift_cam_imu: t_imu = t_cam + shift

  friend bool operator==(const NamedCamera&, const NamedCamera&) = default;
};

/// Reads all cameras in a calibration file, which must contain at least one. The format is recognised from
/// the content:
///
/// - ROS camera_info YAML (image_width, camera_matrix, distortion_model plumb_bob | rational_polynomial |
///   equidistant | fisheye; rectification and projection are checked but not used, because images are
///   processed unrectified);
/// - kalibr camchain (cam0: camera_model pinhole, distortion_model radtan | equidistant | none), also as
///   TagSLAM writes it;
/// - Waymark's robot.yaml or calibration.yaml (its camera_info);
/// - a calibration of PhotonVision (JSON; its observations are skipped);
/// - OpenCV's YAML (FileStorage: camera_matrix, distortion_coefficients, image_width, image_height;
///   fisheye_model not 0 for the equidistant lens).
///
/// Fails with file, line and key on a file of another kind, a missing value, inconsistent values, or
/// parameters that CameraModel::make() rejects. The error for an unknown key or model suggests the nearest
/// valid one.
[[nodiscard]] Result<std::vector<NamedCamera>> read_cameras(const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<NamedCamera>> parse_cameras(std::string_view text,
                                                             const std::string& source);

/// Reads one camera. If no name is given, the file must contain exactly one camera; otherwise the error lists
/// the names. Only the chosen camera of a camchain must be valid.
[[nodiscard]] Result<NamedCamera> read_camera(const std::filesystem::path& path, std::string_view name = {});
[[nodiscard]] Result<NamedCamera> parse_camera(std::string_view text, const std::string& source,
                                               std::string_view name = {});

/// Writes the camera as ROS camera_info YAML, without rectification (R = identity, P = [K 0]). Topic,
/// transforms and time shift are not written. The text reads back as exactly the same intrinsics.
[[nodiscard]] std::string to_camera_info_yaml(const NamedCamera& camera);

/// Writes the cameras as a kalibr camchain. Fails (Unsupported) for the rational model, which kalibr lacks.
[[nodiscard]] Result<std::string> to_camchain_yaml(const std::vector<NamedCamera>& cameras);

/// Writes the camera as OpenCV FileStorage YAML, with the keys used by OpenCV's calibration program
/// (camera_matrix, distortion_coefficients, image_width, image_height; fisheye_model for the equidistant
/// lens). The text reads back as exactly the same intrinsics; a lens without coefficients gets five zeros.
[[nodiscard]] std::string to_opencv_yaml(const NamedCamera& camera);

/// Writes the camera as a PhotonVision calibration, with its observations. Fails (Unsupported) for the
/// equidistant lens, which PhotonVision lacks. The text reads back as exactly as that of to_opencv_yaml().
[[nodiscard]] Result<std::string> to_photonvision_json(
    const NamedCamera& camera, const std::vector<CameraObservation>& observations = {});

}  // namespace waymark
