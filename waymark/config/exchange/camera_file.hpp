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

/// What one picture of a calibration showed, and what the calibration says of it.
struct CameraObservation {
  std::string picture{};
  SE3 cam_T_target{};
  std::vector<Eigen::Vector3d> target_points_m{};
  std::vector<Eigen::Vector2d> seen_px{};  ///< as many; pixel centres at +1/2
  std::vector<Eigen::Vector2d>
      errors_px{};           ///< as many: projected minus seen; not finite where nothing projects
  std::vector<bool> used{};  ///< as many
};

/// A calibrated camera as a file gives it. Intrinsics are in our pixels (centres at +1/2); the files below
/// have centres at integers, and 1/2 is added to c_x and c_y when they are read and taken off when they are
/// written.
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

/// All cameras in a calibration file, at least one. The format is recognised by its content:
///
/// - ROS camera_info YAML (image_width, camera_matrix, distortion_model plumb_bob | rational_polynomial |
/// equidistant |
///   fisheye; rectification and projection are checked and left aside: we work on the images as they come);
/// - kalibr camchain (cam0: camera_model pinhole, distortion_model radtan | equidistant | none), also as
/// TagSLAM writes it;
/// - a robot.yaml or calibration.yaml of ours (its camera_info);
/// - a calibration of PhotonVision (JSON; its observations are passed over, however many);
/// - OpenCV's YAML (FileStorage: camera_matrix, distortion_coefficients, image_width, image_height;
/// fisheye_model not 0
///   for the equidistant lens).
///
/// Errors have file, line and key: not such a file, an unknown key or model (with the nearest word), a
/// missing value, numbers that contradict each other, what CameraModel::make() refuses.
[[nodiscard]] Result<std::vector<NamedCamera>> read_cameras(const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<NamedCamera>> parse_cameras(std::string_view text,
                                                             const std::string& source);

/// One camera. Without a name the file must hold exactly one; the error lists the names there are. Of a
/// camchain only the chosen camera has to be usable.
[[nodiscard]] Result<NamedCamera> read_camera(const std::filesystem::path& path, std::string_view name = {});
[[nodiscard]] Result<NamedCamera> parse_camera(std::string_view text, const std::string& source,
                                               std::string_view name = {});

/// The camera as ROS camera_info YAML, without rectification (R = identity, P = [K 0]). Topic, transforms and
/// time shift have no place in it. Reads back as the same intrinsics, to the last bit.
[[nodiscard]] std::string to_camera_info_yaml(const NamedCamera& camera);

/// The cameras as a kalibr camchain. Fails (Unsupported) for the rational model, which kalibr does not have.
[[nodiscard]] Result<std::string> to_camchain_yaml(const std::vector<NamedCamera>& cameras);

/// The camera in the YAML of OpenCV's FileStorage, with the keys of OpenCV's calibration program
/// (camera_matrix, distortion_coefficients, image_width, image_height; fisheye_model for the equidistant
/// lens). Reads back as the same intrinsics, to the last bit; a lens without coefficients as one with five
/// zeros.
[[nodiscard]] std::string to_opencv_yaml(const NamedCamera& camera);

/// The camera as a calibration of PhotonVision, with what it was found from. Fails (Unsupported) for the
/// equidistant lens, which PhotonVision does not have. Reads back as to_opencv_yaml() does.
[[nodiscard]] Result<std::string> to_photonvision_json(
    const NamedCamera& camera, const std::vector<CameraObservation>& observations = {});

}  // namespace waymark
