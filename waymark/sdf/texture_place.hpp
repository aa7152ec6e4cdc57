#pragma once

#include <array>
#include <vector>

#include "waymark/sdf/read_sdf.hpp"

namespace waymark {

/// The surface of a visual as triangles in its own frame. Boxes have six faces and planes one. They are
/// textured as in Gazebo (gz-common, MeshManager::CreateBox() and CreatePlane()): upright on the four sides;
/// on top and bottom the upper edge is towards +x and -x. Faces are in the order +x, +y, +z, -x, -y, -z. For
/// meshes the mesh triangles are returned, for other shapes none.
[[nodiscard]] std::vector<TexturedTriangle> triangles_of(const SdfVisual& visual);

/// A flat quadrilateral of the texture in space.
struct PlacedQuad {
  std::array<Eigen::Vector3d, 4> visual_p{};  ///< [m], in the frame of the visual
  bool mirrored = false;                      ///< as seen from outside
};

/// Locates four points of the texture in space, once for each face that contains their centre. Uses the
/// affine map of the triangle from texture to space. O(triangles).
[[nodiscard]] std::vector<PlacedQuad> placed_on(const std::vector<TexturedTriangle>& triangles,
                                                const std::array<Eigen::Vector2d, 4>& uv);

}  // namespace waymark
