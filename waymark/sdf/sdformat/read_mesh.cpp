#include "waymark/sdf/sdformat/read_mesh.hpp"

#include <limits>
#include <span>
#include <system_error>

#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>

namespace waymark {
namespace {

namespace fs = std::filesystem;

Eigen::Vector3d scaled(const aiVector3D& v, const Eigen::Vector3d& scale) {
  return Eigen::Vector3d(v.x, v.y, v.z).cwiseProduct(scale);
}

void add_triangles(const aiMesh& mesh, const Eigen::Vector3d& scale, MeshSurface& surface) {
  const std::span vertices(mesh.mVertices, mesh.mNumVertices);
  for (const aiVector3D& vertex : vertices) {
    surface.least_m = surface.least_m.cwiseMin(scaled(vertex, scale));
    surface.most_m = surface.most_m.cwiseMax(scaled(vertex, scale));
  }
  if (!mesh.HasTextureCoords(0)) return;
  const std::span uv(mesh.mTextureCoords[0], mesh.mNumVertices);
  for (const aiFace& face : std::span(mesh.mFaces, mesh.mNumFaces)) {
    if (face.mNumIndices != 3) continue;
    TexturedTriangle triangle;
    for (unsigned i = 0; i < 3; ++i) {
      const unsigned index = face.mIndices[i];
      triangle.visual_p[i] = scaled(vertices[index], scale);
      triangle.uv[i] = {uv[index].x, uv[index].y};
    }
    surface.triangles.push_back(triangle);
  }
}

/// The texture file: the path from the material, or a file next to the mesh or, as in Gazebo models, in
/// materials/textures.
fs::path texture_of(const aiScene& scene, const fs::path& mesh) {
  for (const aiMaterial* material : std::span(scene.mMaterials, scene.mNumMaterials)) {
    aiString name;
    if (material->GetTexture(aiTextureType_DIFFUSE, 0, &name) != aiReturn_SUCCESS) continue;
    const fs::path wanted = name.C_Str();
    const fs::path folder = mesh.parent_path();
    std::error_code ignored;
    for (const fs::path& place : {folder / wanted, folder / wanted.filename(),
                                  folder / ".." / "materials" / "textures" / wanted.filename()})
      if (fs::is_regular_file(place, ignored)) return place;
  }
  return {};
}

}  // namespace

Result<MeshSurface> read_mesh(const fs::path& file, const Eigen::Vector3d& scale) {
  constexpr std::uintmax_t kMaxBytes = 256U << 20U;
  std::error_code error;
  if (fs::file_size(file, error) > kMaxBytes || error)
    return fail(ErrorCode::LimitExceeded, "the mesh is missing or larger than 256 MiB",
                {.source = file.string()});
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(
      file.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices | aiProcess_FlipUVs);
  if (scene == nullptr || scene->mNumMeshes == 0)
    return fail(ErrorCode::Unreadable, importer.GetErrorString(), {.source = file.string()});
  constexpr double kMaxDouble = std::numeric_limits<double>::max();
  MeshSurface surface{.least_m = Eigen::Vector3d::Constant(kMaxDouble),
                      .most_m = Eigen::Vector3d::Constant(-kMaxDouble)};
  std::size_t faces = 0;
  for (const aiMesh* mesh : std::span(scene->mMeshes, scene->mNumMeshes)) {
    constexpr std::size_t kMaxFaces = 1'000'000;
    faces += mesh->mNumFaces;
    if (faces > kMaxFaces)
      return fail(ErrorCode::LimitExceeded, "the mesh has more than a million faces",
                  {.source = file.string()});
    add_triangles(*mesh, scale, surface);
  }
  surface.texture = texture_of(*scene, file);
  return surface;
}

}  // namespace waymark
