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

/// The key `motion` in a robot's file (docs/formats/robot.md): the uncertainty of its odometry, as fields of
/// MotionNoise. Empty if the file does not contain it. Errors contain file, line and key.
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
      more_cameras{};  ///< cameras other than the first, which is `camera` with its mounting in `model`
  std::optional<CommissionRecord> commissioned{};  ///< results of its first drive
};

/// Reads a robot from YAML (docs/formats/robot.md explains all keys): name, hull, limits, wheels,
/// camera_mounting and camera_info. For several cameras, the list `cameras` contains the last two and a name
/// for each. Roll, pitch and yaw in camera_mounting are those of the camera body, which points straight ahead
/// if they are zero; camera_info is as written by ROS. Optional keys are simulation (fields of
/// SimulatedRobotOptions) and commissioned (CommissionRecord). Fails with file, line and key on an unknown or
/// missing key, a length or a limit that is not positive, or parameters that CameraModel::make() rejects.
[[nodiscard]] Result<RobotDescription> read_robot(const std::filesystem::path& path);
[[nodiscard]] Result<RobotDescription> parse_robot(std::string_view text, const std::string& source);

/// The text of a robot's file with a new mounting for the first camera; everything else, including comments,
/// is unchanged. Fails if the text is not a robot's file.
[[nodiscard]] Result<std::string> with_camera_mounting(std::string_view text, const SE3& base_T_cam);

/// Writes a robot as YAML without `commissioned`, which with_commission() adds. The text reads back as the
/// same robot, with camera angles equal within rounding.
[[nodiscard]] std::string to_yaml(const RobotDescription& robot);

/// A file that comes with Waymark.
struct ListedFile {
  std::string name{};
  std::filesystem::path path{};
};

/// The YAML files in a folder ("robots", "ros2") of the share folder, by name. Fails if it does not exist.
[[nodiscard]] Result<std::vector<ListedFile>> list_shared(std::string_view folder);

/// The comment lines at the beginning of a YAML file, joined by spaces. They name the sources of its values.
[[nodiscard]] std::string leading_comment(std::string_view yaml);
/// The first sentence of leading_comment().
[[nodiscard]] std::string first_sentence(const std::string& text);

/// A robot and the leading_comment() of its file.
struct CommentedRobot {
  RobotDescription robot;
  std::string comment{};
};
[[nodiscard]] Result<CommentedRobot> read_commented_robot(const std::filesystem::path& path);

/// The robot with this name, or the one in the file at this path.
[[nodiscard]] Result<RobotDescription> read_named_robot(const std::string& name);

}  // namespace waymark
