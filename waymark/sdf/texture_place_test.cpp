#include "waymark/sdf/texture_place.hpp"

#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using Vec3 = Eigen::Vector3d;

constexpr double kTiny = 1e-12;
const std::array<Eigen::Vector2d, 4> kWhole = {Eigen::Vector2d(0, 0), {1, 0}, {1, 1}, {0, 1}};

SdfVisual shape(SdfShape kind, const Vec3& size_m) { return {.shape = kind, .size_m = size_m}; }

Vec3 right_of(const PlacedQuad& quad) { return quad.visual_p[1] - quad.visual_p[0]; }
Vec3 down_of(const PlacedQuad& quad) { return quad.visual_p[3] - quad.visual_p[0]; }
Vec3 middle_of(const PlacedQuad& quad) { return (quad.visual_p[0] + quad.visual_p[2]) / 2; }

TEST(TexturePlace, ABoxShowsTheImageUprightAndNotMirrored) {
  const Vec3 size_m(0.3, 0.5, 0.7);
  const auto faces = placed_on(triangles_of(shape(SdfShape::Box, size_m)), kWhole);
  ASSERT_EQ(faces.size(), 6U);
  const Vec3 out[] = {Vec3::UnitX(),  Vec3::UnitY(),  Vec3::UnitZ(),
                      -Vec3::UnitX(), -Vec3::UnitY(), -Vec3::UnitZ()};
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const PlacedQuad& face = faces[i];
    EXPECT_FALSE(face.mirrored) << i;
    EXPECT_LT((middle_of(face) - out[i].cwiseProduct(size_m) / 2).norm(), kTiny) << i;
    EXPECT_LT((right_of(face).cross(down_of(face)).normalized() + out[i]).norm(), kTiny)
        << "facing into the box " << i;
    if (out[i].z() != 0) continue;
    EXPECT_LT((down_of(face) + size_m.z() * Vec3::UnitZ()).norm(), kTiny) << "upright " << i;
  }
  EXPECT_LT((down_of(faces[2]) + size_m.x() * Vec3::UnitX()).norm(), kTiny)
      << "the upper edge of the texture on the top face is at +x";
  EXPECT_LT((down_of(faces[5]) - size_m.x() * Vec3::UnitX()).norm(), kTiny)
      << "the upper edge of the texture on the bottom face is at -x";
}

TEST(TexturePlace, APlaneFacesAlongItsNormal) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    SdfVisual plane = shape(SdfShape::Plane, {0.2, 0.4, 0});
    plane.visual_n_plane = Vec3(random.normal(), random.normal(), random.normal()).normalized();
    const auto faces = placed_on(triangles_of(plane), kWhole);
    ASSERT_EQ(faces.size(), 1U);
    EXPECT_FALSE(faces[0].mirrored);
    EXPECT_NEAR(right_of(faces[0]).norm(), 0.2, kTiny);
    EXPECT_NEAR(down_of(faces[0]).norm(), 0.4, kTiny);
    EXPECT_LT((right_of(faces[0]).cross(down_of(faces[0])).normalized() + plane.visual_n_plane).norm(), 1e-9);
  }
}

TEST(TexturePlace, APartOfTheImageIsThatPartOfTheFace) {
  const std::array<Eigen::Vector2d, 4> piece = {
      Eigen::Vector2d(0.6, 0.1), {0.8, 0.1}, {0.8, 0.3}, {0.6, 0.3}};
  const auto faces = placed_on(triangles_of(shape(SdfShape::Plane, {2, 1, 0})), piece);
  ASSERT_EQ(faces.size(), 1U);
  EXPECT_LT((faces[0].visual_p[0] - Vec3(0.2, 0.4, 0)).norm(), kTiny);
  EXPECT_LT((faces[0].visual_p[2] - Vec3(0.6, 0.2, 0)).norm(), kTiny);
}

TEST(TexturePlace, AMeshMayMirrorTheImageOrLackTextureArea) {
  SdfVisual mesh = shape(SdfShape::Mesh, {1, 1, 0});
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  mesh.mesh = {{{Vec3::Zero(), x, x + y}, {Eigen::Vector2d(1, 1), {0, 1}, {0, 0}}},
               {{Vec3::Zero(), x + y, y}, {Eigen::Vector2d(1, 1), {0, 0}, {1, 0}}}};
  const auto mirrored = placed_on(triangles_of(mesh), kWhole);
  ASSERT_EQ(mirrored.size(), 1U);
  EXPECT_TRUE(mirrored[0].mirrored);
  for (TexturedTriangle& triangle : mesh.mesh) triangle.uv.fill(Eigen::Vector2d(0.5, 0.5));
  EXPECT_TRUE(placed_on(triangles_of(mesh), kWhole).empty())
      << "all corners have the same texture coordinates";
  EXPECT_TRUE(placed_on(triangles_of(shape(SdfShape::Sphere, {1, 1, 1})), kWhole).empty());
}

}  // namespace
}  // namespace waymark
