#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/image/image.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {

/// An image to which an SDF file refers.
struct SdfTexture {
  std::string name{};  ///< such as "tag36h11_7.png", located next to the file
  Image image{};
};

struct SdfFiles {
  std::string world{};  ///< contents of the file
  std::vector<SdfTexture> textures{};
  std::vector<std::string> notes{};  ///< differences between the world file and what Gazebo displays
};

/// Writes the world, with the robot at the start of its line, in SDF 1.9 for Gazebo Fortress. The output
/// contains the plugins for physics, sensors, IMU, commands and scene with their ignition:: names, a light,
/// the floor, walls, furniture and boards. Each readable tag is a plane with its bitmap and white margin,
/// half a millimetre in front of its board. The world frame is map. Colours are shades of grey (reflectance).
/// Keep-outs, the line and floor textures are not written.
[[nodiscard]] SdfFiles write_sdf_world(const World& world, const RobotDescription& robot);

/// A model name that plugins can use in topics; it consists of letters, digits and _.
[[nodiscard]] std::string sdf_model_name(const std::string& name);

/// Writes a robot as a model in SDF 1.9 for Gazebo Fortress. Its body has the size of the robot's hull and
/// runs on four wheels (skid steering). The model includes the diff-drive plugin and its limits, a camera, an
/// IMU, a lidar if the robot has one, and a publisher for its true pose. Topics:
/// /model/NAME/{cmd_vel,odometry,pose}, /camera, /camera_info, /imu, /scan. Values missing from the robot
/// file are those of a LIMO: 4 kg, a wheelbase of 0.6 times its length, friction 1.2. Camera properties that
/// Gazebo cannot reproduce are added to `notes`.
[[nodiscard]] std::string write_sdf_robot(const RobotDescription& robot, const SE3& world_T_base,
                                          std::vector<std::string>& notes);

/// Text of the profile with which Waymark drives that model (share/gazebo).
[[nodiscard]] std::string gazebo_profile_of(const RobotDescription& robot, const std::string& robot_file);

}  // namespace waymark

/// SDF elements as text, exposed for tests. As in SDF, lengths are in metres and angles in radians.
namespace waymark::sdf_text {

/// "x y z roll pitch yaw"
[[nodiscard]] std::string pose(const SE3& pose);
[[nodiscard]] std::string box(const Eigen::Vector3d& size_m);
/// A grey colour with the given reflectance.
[[nodiscard]] std::string grey(double reflectance);
/// A collision and a visual for one shape.
[[nodiscard]] std::string solid(std::string_view name, const SE3& link_T_solid, std::string_view geometry,
                                double reflectance);
/// A static model with a single link.
[[nodiscard]] std::string fixed_model(std::string_view name, const SE3& world_T_model,
                                      std::string_view content);

}  // namespace waymark::sdf_text
