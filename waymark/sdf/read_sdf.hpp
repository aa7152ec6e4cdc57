#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/geometry/se3.hpp"

/// A world in SDF as plain values. Frame world is the world frame of the file, with z up.
namespace waymark {

/// A triangle and the texture coordinates of its corners; u points right and v down, both from 0 to 1.
struct TexturedTriangle {
  std::array<Eigen::Vector3d, 3>
      visual_p{};  ///< [m], in the frame of the visual, counter-clockwise as seen from outside
  std::array<Eigen::Vector2d, 3> uv{};
};

enum class SdfShape : std::uint8_t { Box, Plane, Cylinder, Sphere, Mesh, Other };

/// A visible shape.
struct SdfVisual {
  std::string name{};  ///< "model::link::visual"
  SE3 world_T_visual{};
  SdfShape shape = SdfShape::Other;
  /// [m] Side lengths of the bounding box along its own axes; the third is 0 for a plane.
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d visual_t_centre = Eigen::Vector3d::Zero();  ///< centre of the bounding box
  Eigen::Vector3d visual_n_plane = Eigen::Vector3d::UnitZ();  ///< normal, if the visual is a plane
  std::string texture{};     ///< image file; empty if there is none or it was not found
  double reflectance = 0.5;  ///< mean of the diffuse colour, 0 to 1
  bool fixed = true;         ///< whether its model is static
  std::vector<TexturedTriangle> mesh{};
};

struct SdfLight {
  std::string name{};
  std::string kind{};  ///< directional, point, spot
  Eigen::Vector3d world_t_light = Eigen::Vector3d::Zero();
  double intensity = 1;
};

struct SdfModelPose {
  std::string name{};
  SE3 world_T_model{};
  bool fixed = true;
};

struct SdfScene {
  std::string name{};
  std::vector<SdfVisual> visuals{};
  std::vector<SdfLight> lights{};
  std::vector<SdfModelPose> models{};
  std::vector<std::string> warnings{};  ///< warnings from the parser, and missing files
};

/// Reads the first world in an SDF file (any version that SDFormat 12 reads), or a file with a single model.
/// Resolves model:// URIs and relative names by searching the folders, then next to the file, in folders
/// named `models` next to it and further up, and in IGN_GAZEBO_RESOURCE_PATH and SDF_PATH. Fails if the file
/// is not SDF or the SDF module is not installed.
[[nodiscard]] Result<SdfScene> read_sdf(const std::filesystem::path& file,
                                        const std::vector<std::filesystem::path>& folders = {});

/// The function exported by the module. It returns the scene, or an error with a message.
using ReadSdfFunction = void (*)(const std::filesystem::path& file,
                                 const std::vector<std::filesystem::path>& folders, SdfScene& scene,
                                 Error& error);
inline constexpr const char* kReadSdfSymbol = "waymark_read_sdf";

}  // namespace waymark
