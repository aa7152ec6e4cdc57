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

/// A picture that an SDF file names.
struct SdfTexture {
  std::string name{};  ///< "tag36h11_7.png", beside the file
  Image image{};
};

struct SdfFiles {
  std::string world{};  ///< the text of the file
  std::vector<SdfTexture> textures{};
  std::vector<std::string> notes{};  ///< what Gazebo shows otherwise than the world file says
};

/// The place and, at the start of its line, the robot as a world in SDF 1.9 for Gazebo Fortress: the plugins
/// of physics, sensors, IMU, commands and scene in their ignition:: names, a light, the floor, walls,
/// furniture, boards, and each tag that can be read as a plane with its bitmap and white margin, half a
/// millimetre before its board. Frame world: map. Colours are greys (reflectance). Not written: keep-outs,
/// the line, textures of the floor.
[[nodiscard]] SdfFiles write_sdf_world(const World& world, const RobotDescription& robot);

/// The name of a model that plugins can name topics after: letters, digits and _.
[[nodiscard]] std::string sdf_model_name(const std::string& name);

/// A robot as a model in SDF 1.9 for Gazebo Fortress: a body of the size of its hull on four wheels (skid
/// steering), with the diff-drive plugin and its limits, a camera, an IMU, a lidar where it has one, and a
/// publisher of its true pose. Topics: /model/NAME/{cmd_vel,odometry,pose}, /camera, /camera_info, /imu,
/// /scan. What its file does not tell is that of a LIMO: 4 kg, wheels 0.6 of its length apart, friction 1.2.
/// `notes` gets what Gazebo's camera cannot do.
[[nodiscard]] std::string write_sdf_robot(const RobotDescription& robot, const SE3& world_T_base,
                                          std::vector<std::string>& notes);

/// How Waymark drives that model (share/gazebo): the text of a profile.
[[nodiscard]] std::string gazebo_profile_of(const RobotDescription& robot, const std::string& robot_file);

}  // namespace waymark

/// Pieces of SDF as text, for the tests of the room. Lengths in metres, angles in radians, as SDF has them.
namespace waymark::sdf_text {

/// "x y z roll pitch yaw"
[[nodiscard]] std::string pose(const SE3& pose);
[[nodiscard]] std::string box(const Eigen::Vector3d& size_m);
/// A colour as grey, which gives back this share of the light.
[[nodiscard]] std::string grey(double reflectance);
/// A collision and a visual of one shape.
[[nodiscard]] std::string solid(std::string_view name, const SE3& link_T_solid, std::string_view geometry,
                                double reflectance);
/// A model of one link that never moves.
[[nodiscard]] std::string fixed_model(std::string_view name, const SE3& world_T_model,
                                      std::string_view content);

}  // namespace waymark::sdf_text
