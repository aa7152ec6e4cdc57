#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/simulation/simulated_robot_options.hpp"

namespace waymark {

/// What a robot's file says of it.
struct RobotDescription {
  RobotModel model;
  CameraModel camera;
  SimulatedRobotOptions simulation{};  ///< how it behaves where it does not exist
};

/// A robot from YAML (docs/formats/robot.md explains all keys): name, hull, limits, wheels, camera_mounting
/// (roll, pitch, yaw of the camera's body, straight ahead when zero), camera_info (as ROS writes it); where
/// wanted simulation (fields of SimulatedRobotOptions). Errors have file, line and key: an unknown or missing
/// key, a length or a limit that is not positive, what CameraModel::make() refuses.
[[nodiscard]] Result<RobotDescription> read_robot(const std::filesystem::path& path);
[[nodiscard]] Result<RobotDescription> parse_robot(std::string_view text, const std::string& source);

/// The text of a robot's file with the camera elsewhere; all else stays as it is written, comments too. Fails
/// on a text that is no robot's file.
[[nodiscard]] Result<std::string> with_camera_mounting(std::string_view text, const SE3& base_T_cam);

/// The same as YAML. Reads back as the same robot; the angles of the camera within rounding.
[[nodiscard]] std::string to_yaml(const RobotDescription& robot);

}  // namespace waymark
