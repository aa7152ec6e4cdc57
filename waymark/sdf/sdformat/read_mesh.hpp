#pragma once

// Internal: reads the triangles from a mesh file.

#include <filesystem>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/sdf/read_sdf.hpp"

namespace waymark {

struct MeshSurface {
  std::vector<TexturedTriangle> triangles{};          ///< triangles that have texture coordinates
  Eigen::Vector3d least_m = Eigen::Vector3d::Zero();  ///< lower corner of the bounding box of all triangles;
                                                      ///< the upper one is most_m
  Eigen::Vector3d most_m = Eigen::Vector3d::Zero();
  std::filesystem::path
      texture{};  ///< of the first material that has one; empty if there is none or it was not found
};

/// Reads COLLADA, Wavefront OBJ, STL, glTF and other formats supported by assimp, scaled, with the axes and
/// units of the file. Fails if assimp fails or if there are more than a million triangles.
[[nodiscard]] Result<MeshSurface> read_mesh(const std::filesystem::path& file, const Eigen::Vector3d& scale);

}  // namespace waymark
