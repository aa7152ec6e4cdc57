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

/// An image referenced by an SDF file.
struct SdfTexture {
  std::string name{};  ///< "tag36h11_7.png", next to the file
  Image image{};
};

struct SdfFiles {
  std::string world{};  ///< text of the file
  std::vector<SdfTexture> textures{};
  std::vector<std::string> notes{};  ///< differences between the world file and what Gazebo shows
};

/// Writes the world, with the robot at the start of its line, in SDF 1.9 for Gazebo Fortress. Written are the
/// plugins of physics, sensors, IMU, commands and scene with their ignition:: names, a light, the floor,
/// walls, furniture and boards. Each readable tag is a plane with its bitmap and white margin, half a
/// millimetre in front of its board. Frame world: map. Colours are grey (reflectance). Not written:
/// keep-outs, the line, textures of the floor.
[[nodiscard]] SdfFiles write_sdf_world(const World& world, const RobotDescription& robot);

/// A model name that plugins can use in topics: letters, digits and _.
[[nodiscard]] std::string sdf_model_name(const std::string& name);

/// Writes a robot as a model in SDF 1.9 for Gazebo Fortress. Its body has the size of the robot's hull, on
/// four wheels (skid steering). The model includes the diff-drive plugin and its limits, a camera, an IMU, a
/// lidar if the robot has one, and a publisher of its true pose. Topics: /model/NAME/{cmd_vel,odometry,pose},
/// /camera, /camera_info, /imu, /scan. Values missing in the robot file are those of a LIMO: 4 kg, wheels 0.6
/// of its length apart, friction 1.2. `notes` receives properties that Gazebo's camera cannot reproduce.
[[nodiscard]] std::string write_sdf_robot(const RobotDescription& robot, const SE3& world_T_base,
                                          std::vector<std::string>& notes);

/// Text of the profile that Waymark needs to drive that model (share/gazebo).
[[nodiscard]] std::string gazebo_profile_of(const RobotDescription& robot, const std::string& robot_file);

}  // namespace waymark

/// Parts of SDF as text, exposed for tests. Lengths are in metres, angles in radians, as in SDF.
namespace waymark::sdf_text {

/// "x y z roll pitch yaw"
[[nodiscard]] std::string pose(const SE3& pose);
[[nodiscard]] std::string box(const Eigen::Vector3d& size_m);
/// A grey colour with this reflectance.
[[nodiscard]] std::string grey(double reflectance);
/// A collision and a visual of one shape.
[[nodiscard]] std::string solid(std::string_view name, const SE3& link_T_solid, std::string_view geometry,
                                double reflectance);
/// A static model with one link.
[[nodiscard]] std::string fixed_model(std::string_view name, const SE3& world_T_model,
                                      std::string_view content);

}  // namespace waymark::sdf_text
