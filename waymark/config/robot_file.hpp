#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/config/commission_record.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/simulation/robot/simulated_robot_options.hpp"

namespace waymark {

/// What a robot's file says of it.
struct RobotDescription {
  RobotModel model;
  CameraModel camera;
  SimulatedRobotOptions simulation{};  ///< how it behaves where it does not exist
  std::string camera_name = "cam";
  std::vector<MountedCamera> more_cameras{};       ///< beside the first: `camera`, mounted as `model` says
  std::optional<CommissionRecord> commissioned{};  ///< what its first drive found
};

/// A robot from YAML (docs/formats/robot.md explains all keys): name, hull, limits, wheels, camera_mounting
/// (roll, pitch, yaw of the camera's body, straight ahead when zero), camera_info (as ROS writes it), or both
/// for each of `cameras`, a list with names; where
/// wanted simulation (fields of SimulatedRobotOptions) and commissioned (CommissionRecord). Errors have file,
/// line and key: an unknown or missing key, a length or a limit that is not positive, what
/// CameraModel::make() refuses.
[[nodiscard]] Result<RobotDescription> read_robot(const std::filesystem::path& path);
[[nodiscard]] Result<RobotDescription> parse_robot(std::string_view text, const std::string& source);

/// The text of a robot's file with the first camera elsewhere; all else stays as it is written, comments too.
/// Fails on a text that is no robot's file.
[[nodiscard]] Result<std::string> with_camera_mounting(std::string_view text, const SE3& base_T_cam);

/// The same as YAML, without `commissioned`, which with_commission() adds. Reads back as the same robot; the
/// angles of the camera within rounding.
[[nodiscard]] std::string to_yaml(const RobotDescription& robot);

}  // namespace waymark
