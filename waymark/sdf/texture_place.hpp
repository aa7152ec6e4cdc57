#pragma once

#include <array>
#include <vector>

#include "waymark/sdf/read_sdf.hpp"

namespace waymark {

/// The surface of a visual as triangles in its own frame. Boxes have six faces and planes have one. They are
/// textured as in Gazebo (gz-common, MeshManager::CreateBox() and CreatePlane()): upright on the four sides.
/// On the top and bottom faces, the upper edge of the texture is towards +x and -x, respectively. Faces are
/// in the order +x, +y, +z, -x, -y, -z. For meshes, the triangles of the mesh are returned; for other shapes,
/// nothing is returned.
[[nodiscard]] std::vector<TexturedTriangle> triangles_of(const SdfVisual& visual);

/// A flat quadrilateral of the texture, placed in space.
struct PlacedQuad {
  std::array<Eigen::Vector3d, 4> visual_p{};  ///< [m], in the frame of the visual
  bool mirrored = false;                      ///< as seen from outside
};

/// Locates four points of the texture in space, once for each face that contains their centre. Uses the
/// affine map from texture to space given by the triangle. O(triangles).
[[nodiscard]] std::vector<PlacedQuad> placed_on(const std::vector<TexturedTriangle>& triangles,
                                                const std::array<Eigen::Vector2d, 4>& uv);

}  // namespace waymark
