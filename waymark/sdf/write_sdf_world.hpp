#pragma once

#include <string>
#include <vector>

#include "waymark/config/robot_file.hpp"
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

}  // namespace waymark
