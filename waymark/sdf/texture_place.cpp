#include "waymark/sdf/texture_place.hpp"
#include "waymark/geometry/dense.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Dense>
#include <Eigen/Geometry>

namespace waymark {
namespace {

using Vec3 = Eigen::Vector3d;

/// Adds a rectangle centred on `middle`; `right` and `down` are its sides along the texture axes, as seen
/// from outside.
void add_face(const Vec3& middle, const Vec3& right, const Vec3& down,
              std::vector<TexturedTriangle>& triangles) {
  const Vec3 top_left = middle - right / 2 - down / 2;
  const std::array<Vec3, 4> p = {top_left, top_left + right, top_left + right + down, top_left + down};
  const std::array<Eigen::Vector2d, 4> uv = {Eigen::Vector2d(0, 0), {1, 0}, {1, 1}, {0, 1}};
  triangles.push_back({{p[0], p[2], p[1]}, {uv[0], uv[2], uv[1]}});  // counter-clockwise as seen from outside
  triangles.push_back({{p[0], p[3], p[2]}, {uv[0], uv[3], uv[2]}});
}

void add_box(const SdfVisual& box, std::vector<TexturedTriangle>& triangles) {
  struct Face {
    Vec3 out, right, down;
  };
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  for (const Face& face : {Face{x, y, -z}, Face{y, -x, -z}, Face{z, -y, -x}, Face{-x, -y, -z},
                           Face{-y, x, -z}, Face{-z, -y, x}}) {
    const auto scaled = [&](const Vec3& axis) -> Vec3 { return axis.cwiseProduct(box.size_m); };
    add_face(box.visual_t_centre + scaled(face.out) / 2, scaled(face.right), scaled(face.down), triangles);
  }
}

void add_plane(const SdfVisual& plane, std::vector<TexturedTriangle>& triangles) {
  const Eigen::Quaterniond turn = rotation_between(Vec3::UnitZ(), plane.visual_n_plane);
  add_face(plane.visual_t_centre, turn * (plane.size_m.x() * Vec3::UnitX()),
           turn * (-plane.size_m.y() * Vec3::UnitY()), triangles);
}

/// Barycentric weights of a point in the texture; `nullopt` if the triangle has no area in the texture.
std::optional<Vec3> weights_at(const TexturedTriangle& triangle, const Eigen::Vector2d& uv) {
  Eigen::Matrix2d sides;
  sides << triangle.uv[1] - triangle.uv[0], triangle.uv[2] - triangle.uv[0];
  constexpr double kLeastArea = 1e-12;
  if (!(std::abs(sides.determinant()) > kLeastArea)) return std::nullopt;
  const Eigen::Vector2d w = sides.inverse() * (uv - triangle.uv[0]);
  return Vec3(1 - w.x() - w.y(), w.x(), w.y());
}

Vec3 point_at(const TexturedTriangle& triangle, const Vec3& weights) {
  return weights[0] * triangle.visual_p[0] + weights[1] * triangle.visual_p[1] +
         weights[2] * triangle.visual_p[2];
}

}  // namespace

std::vector<TexturedTriangle> triangles_of(const SdfVisual& visual) {
  std::vector<TexturedTriangle> triangles = visual.mesh;
  if (visual.shape == SdfShape::Box) add_box(visual, triangles);
  if (visual.shape == SdfShape::Plane) add_plane(visual, triangles);
  return triangles;
}

std::vector<PlacedQuad> placed_on(const std::vector<TexturedTriangle>& triangles,
                                  const std::array<Eigen::Vector2d, 4>& uv) {
  std::vector<PlacedQuad> quads;
  const Eigen::Vector2d middle = (uv[0] + uv[1] + uv[2] + uv[3]) / 4;
  for (const TexturedTriangle& triangle : triangles) {
    constexpr double kOnEdge = -1e-9;
    const auto inside = weights_at(triangle, middle);
    if (!inside || !(inside->minCoeff() >= kOnEdge)) continue;
    PlacedQuad quad;
    std::ranges::transform(uv, quad.visual_p.begin(), [&](const Eigen::Vector2d& corner) {
      return point_at(triangle, *weights_at(triangle, corner));
    });
    const auto& [a, b, c] = triangle.visual_p;
    const Vec3 out = (b - a).cross(c - a);
    const Vec3 into = (quad.visual_p[1] - quad.visual_p[0]).cross(quad.visual_p[3] - quad.visual_p[0]);
    quad.mirrored = out.dot(into) > 0;
    const bool known = std::ranges::any_of(quads, [&](const PlacedQuad& other) {
      constexpr double kSame_m = 1e-6;  // the second triangle of the same face
      return (other.visual_p[0] - quad.visual_p[0]).norm() < kSame_m &&
             (other.visual_p[2] - quad.visual_p[2]).norm() < kSame_m;
    });
    if (!known) quads.push_back(quad);
  }
  return quads;
}

}  // namespace waymark
