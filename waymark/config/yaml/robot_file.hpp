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

/// The key motion of a robot's file (docs/formats/robot.md): how far its odometry may be from the truth, in
/// fields of MotionNoise. Nothing when the file does not say it. Errors have file, line and key.
[[nodiscard]] Result<std::optional<MotionNoise>> read_robot_motion(const std::filesystem::path& path);
[[nodiscard]] Result<std::optional<MotionNoise>> parse_robot_motion(std::string_view text,
                                                                    const std::string& source);

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

/// A file among those that come with Waymark.
struct ListedFile {
  std::string name{};
  std::filesystem::path path{};
};

/// The YAML files in a folder ("robots", "ros2") of the share folder, by name. Fails when it is not there.
[[nodiscard]] Result<std::vector<ListedFile>> list_shared(std::string_view folder);

/// What the lines of comment at the begin of a YAML file say, joined by spaces; where its facts are from.
[[nodiscard]] std::string leading_comment(std::string_view yaml);
/// Its first sentence.
[[nodiscard]] std::string first_sentence(const std::string& text);

/// A robot and what its file says in words: leading_comment().
struct CommentedRobot {
  RobotDescription robot;
  std::string comment{};
};
[[nodiscard]] Result<CommentedRobot> read_commented_robot(const std::filesystem::path& path);

/// The robot of this name, or of the file at this path.
[[nodiscard]] Result<RobotDescription> read_named_robot(const std::string& name);

}  // namespace waymark
