#pragma once

#include <array>
#include <vector>

#include "waymark/sdf/read_sdf.hpp"

namespace waymark {

/// The surface of a visual as triangles in its own frame: the six faces of a box and one of a plane with the
/// texture as Gazebo lays it there (gz-common, MeshManager::CreateBox() and CreatePlane(): upright on the
/// four sides; on top and below its upper edge towards +x and -x), faces in the order +x, +y, +z, -x, -y, -z;
/// those of a mesh. Nothing of any other shape.
[[nodiscard]] std::vector<TexturedTriangle> triangles_of(const SdfVisual& visual);

/// A flat quadrilateral of the texture in space.
struct PlacedQuad {
  std::array<Eigen::Vector3d, 4> visual_p{};  ///< [m], in the frame of the visual
  bool mirrored = false;                      ///< as one who stands outside sees it
};

/// Where four points of the texture are, once for each face on which the middle of them lies. The map from
/// texture to space is that of the triangle (affine). O(triangles).
[[nodiscard]] std::vector<PlacedQuad> placed_on(const std::vector<TexturedTriangle>& triangles,
                                                const std::array<Eigen::Vector2d, 4>& uv);

}  // namespace waymark
