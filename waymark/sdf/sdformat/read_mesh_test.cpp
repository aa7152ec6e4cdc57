// Tests reading triangles and texture coordinates from mesh files, and invalid files.
#include "waymark/sdf/sdformat/read_mesh.hpp"

#include <fstream>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// A two-metre square in the plane z = 1, as Wavefront OBJ.
constexpr const char* kSquare =
    "mtllib square.mtl\nv 0 0 1\nv 2 0 1\nv 2 2 1\nv 0 2 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    "usemtl paint\nf 1/1 2/2 3/3 4/4\n";

class ReadMesh : public ::testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  const fs::path folder_ = testing::fresh_folder("read_mesh");
};

TEST_F(ReadMesh, AQuadrilateralBecomesTwoScaledTexturedTriangles) {
  write("square.mtl", "newmtl paint\nmap_Kd paint.png\n");
  write("paint.png", "x");
  const auto surface = read_mesh(write("square.obj", kSquare), {0.5, 1, 2});
  ASSERT_TRUE(surface) << to_string(surface.error());
  EXPECT_LT((surface->least_m - Eigen::Vector3d(0, 0, 2)).norm(), 1e-6);
  EXPECT_LT((surface->most_m - Eigen::Vector3d(1, 2, 2)).norm(), 1e-6);
  ASSERT_EQ(surface->triangles.size(), 2U);
  for (const TexturedTriangle& triangle : surface->triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(triangle.uv[i].x(), triangle.visual_p[i].x(), 1e-6);
      EXPECT_NEAR(triangle.uv[i].y(), 1 - triangle.visual_p[i].y() / 2, 1e-6) << "v points down";
    }
  }
  EXPECT_EQ(surface->texture, folder_ / "paint.png");
}

TEST_F(ReadMesh, WithoutATextureThereIsOnlyTheBoundingBox) {
  const auto surface = read_mesh(write("bare.obj", "v 0 0 0\nv 1 0 0\nv 0 3 0\nf 1 2 3\n"), {1, 1, 1});
  ASSERT_TRUE(surface) << to_string(surface.error());
  EXPECT_TRUE(surface->triangles.empty());
  EXPECT_TRUE(surface->texture.empty());
  EXPECT_LT((surface->most_m - Eigen::Vector3d(1, 3, 0)).norm(), 1e-6);
}

TEST_F(ReadMesh, InvalidMeshesAreErrorsWithTheirPlace) {
  for (const fs::path& file :
       {write("words.obj", "these are words"), write("empty.dae", ""), folder_ / "gone.dae"}) {
    const auto surface = read_mesh(file, {1, 1, 1});
    ASSERT_FALSE(surface) << file;
    EXPECT_EQ(surface.error().place.source, file.string());
    EXPECT_FALSE(surface.error().message.empty()) << file;
  }
}

}  // namespace
}  // namespace waymark
