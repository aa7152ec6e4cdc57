#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/config/yaml/commission_record.hpp"
#include "waymark/localization/riekf.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/simulation/robot/simulated_robot_options.hpp"

namespace waymark {

/// The key `motion` of a robot's file (docs/formats/robot.md): uncertainty of its odometry, in fields of
/// MotionNoise. Nothing if the file does not contain it. Errors have file, line and key.
[[nodiscard]] Result<std::optional<MotionNoise>> read_robot_motion(const std::filesystem::path& path);
[[nodiscard]] Result<std::optional<MotionNoise>> parse_robot_motion(std::string_view text,
                                                                    const std::string& source);

/// Contents of a robot's file.
struct RobotDescription {
  RobotModel model;
  CameraModel camera;
  SimulatedRobotOptions simulation{};  ///< behaviour in simulation
  std::string camera_name = "cam";
  std::vector<MountedCamera>
      more_cameras{};  ///< in addition to the first, which is `camera` with the mounting in `model`
  std::optional<CommissionRecord> commissioned{};  ///< results of its first drive
};

/// Reads a robot from YAML (docs/formats/robot.md explains all keys): name, hull, limits, wheels,
/// camera_mounting and camera_info. The list `cameras` with names contains the last two for several cameras.
/// Roll, pitch and yaw of camera_mounting are those of the camera's body, straight ahead if zero; camera_info
/// is as written by ROS. Optional: simulation (fields of SimulatedRobotOptions) and commissioned
/// (CommissionRecord). Errors have file, line and key: an unknown or missing key, a length or a limit that is
/// not positive, parameters that CameraModel::make() rejects.
[[nodiscard]] Result<RobotDescription> read_robot(const std::filesystem::path& path);
[[nodiscard]] Result<RobotDescription> parse_robot(std::string_view text, const std::string& source);

/// The text of a robot's file with another mounting of the first camera; everything else including comments
/// is unchanged. Fails if the text is not a robot's file.
[[nodiscard]] Result<std::string> with_camera_mounting(std::string_view text, const SE3& base_T_cam);

/// Writes a robot as YAML without `commissioned`, which with_commission() adds. Reads back as the same robot;
/// camera angles within rounding.
[[nodiscard]] std::string to_yaml(const RobotDescription& robot);

/// A file that comes with Waymark.
struct ListedFile {
  std::string name{};
  std::filesystem::path path{};
};

/// The YAML files in a folder ("robots", "ros2") of the share folder, by name. Fails if it does not exist.
[[nodiscard]] Result<std::vector<ListedFile>> list_shared(std::string_view folder);

/// The comment lines at the beginning of a YAML file, joined by spaces. They contain the sources of its
/// values.
[[nodiscard]] std::string leading_comment(std::string_view yaml);
/// Its first sentence.
[[nodiscard]] std::string first_sentence(const std::string& text);

/// A robot and the leading_comment() of its file.
struct CommentedRobot {
  RobotDescription robot;
  std::string comment{};
};
[[nodiscard]] Result<CommentedRobot> read_commented_robot(const std::filesystem::path& path);

/// The robot with this name, or from the file at this path.
[[nodiscard]] Result<RobotDescription> read_named_robot(const std::string& name);

}  // namespace waymark
