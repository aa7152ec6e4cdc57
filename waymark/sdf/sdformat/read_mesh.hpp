#pragma once

// Internal: the triangles of a mesh file.

#include <filesystem>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/sdf/read_sdf.hpp"

namespace waymark {

struct MeshSurface {
  std::vector<TexturedTriangle> triangles{};          ///< those with texture coordinates
  Eigen::Vector3d least_m = Eigen::Vector3d::Zero();  ///< corners of the bounding box of all triangles
  Eigen::Vector3d most_m = Eigen::Vector3d::Zero();
  std::filesystem::path
      texture{};  ///< of the first material with one; empty if there is none or it was not found
};

/// Reads COLLADA, Wavefront OBJ, STL, glTF and other formats of assimp, with the axes and units of the file,
/// scaled. Fails if assimp fails, or on more than a million triangles.
[[nodiscard]] Result<MeshSurface> read_mesh(const std::filesystem::path& file, const Eigen::Vector3d& scale);

}  // namespace waymark
