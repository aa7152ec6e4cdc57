#pragma once

// Inside the room: the triangles of a mesh file.

#include <filesystem>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/sdf/read_sdf.hpp"

namespace waymark {

struct MeshSurface {
  std::vector<TexturedTriangle> triangles{};          ///< those that have a place in a texture
  Eigen::Vector3d least_m = Eigen::Vector3d::Zero();  ///< corners of the box around all of it
  Eigen::Vector3d most_m = Eigen::Vector3d::Zero();
  std::filesystem::path texture{};  ///< of the first material that has one; empty: none, or it was not found
};

/// COLLADA, Wavefront OBJ, STL, glTF and what else assimp reads, its axes and units as the file says, scaled.
/// Fails on what assimp refuses, and on more than a million triangles.
[[nodiscard]] Result<MeshSurface> read_mesh(const std::filesystem::path& file, const Eigen::Vector3d& scale);

}  // namespace waymark
