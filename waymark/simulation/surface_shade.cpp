#include "waymark/simulation/surface_shade.hpp"

#include <algorithm>
#include <cmath>

namespace waymark::render {
namespace {

constexpr float kHorizon = 1e-6F;
constexpr float kFarthestCells = 1e6F;  // that a texel still has a number

float value(const PlaneRays::Form& form, float x, float y, float z) {
  return form.shift + form.x * x + form.y * y + form.z * z;
}

/// Where the line of sight of a pixel corner meets the plane, in cells.
Eigen::Vector2f meet(const PlaneRays& plane, const RayTable& rays, int x, int y, float per_unit) {
  const float rx = rays.rays(0, y)[x];
  const float ry = rays.rays(1, y)[x];
  const float rz = rays.rays(2, y)[x];
  const float scale = per_unit / std::max(value(plane.c, rx, ry, rz), kHorizon);
  const auto near = [](float cells) { return std::max(-kFarthestCells, std::min(kFarthestCells, cells)); };
  return {near(value(plane.a, rx, ry, rz) * scale), near(value(plane.b, rx, ry, rz) * scale)};
}

}  // namespace

void add_texture_nodes(const SurfaceTexture& texture, double cell_m, const PlaneRays& plane,
                       const RayTable& rays, const RayTable::Tile& tile, int node, TileNodes& nodes) {
  constexpr double kNodePx = 2;
  const int y = std::min(tile.y + 2 * node, rays.height_px());
  const auto per_unit = static_cast<float>(1 / cell_m);
  std::array<Eigen::Vector2f, kTileNodes> at;
  for (int i = 0; i < kTileNodes; ++i) {
    at[static_cast<std::size_t>(i)] =
        meet(plane, rays, std::min(tile.x + 2 * i, rays.width_px()), y, per_unit);
  }
  // The longer side of what a node stands for, in the middle of the row.
  const int x = std::min(tile.x + kTilePx / 2, rays.width_px());
  const int other = y < rays.height_px() ? y + 1 : y - 1;
  const float down = (meet(plane, rays, x, other, per_unit) - meet(plane, rays, x, y, per_unit)).norm();
  const float across = (at[kTileNodes / 2 + 1] - at[kTileNodes / 2 - 1]).norm() / 4;
  const double footprint =
      static_cast<double>(std::max(across, down)) * kNodePx * SurfaceTexture::kTexelsPerCell;
  const SurfaceTexture::Level level = texture.level(footprint);
  float* to = nodes.data() + row_major(node, kTileNodes);
  for (const Eigen::Vector2f& uv : at) *to++ += SurfaceTexture::at(level, uv.x(), uv.y());
}

void spread_nodes(const TileNodes& nodes, float scale, TileValues& values) {
  for (int y = 0; y < kTilePx; ++y) {
    const float below = y % 2 == 0 ? 0.25F : 0.75F;
    const float* top = nodes.data() + row_major(y / 2, kTileNodes);
    const float* bottom = top + kTileNodes;
    float* to = values.data() + row_major(y, kTilePx);
    for (int i = 0; i + 1 < kTileNodes; ++i) {
      const float left = scale * (top[i] + below * (bottom[i] - top[i]));
      const float right = scale * (top[i + 1] + below * (bottom[i + 1] - top[i + 1]));
      *to++ += left + 0.25F * (right - left);
      *to++ += left + 0.75F * (right - left);
    }
  }
}

void add_glare(const SurfaceView& view, const SE3& map_T_cam, const Eigen::Vector3d& map_t_lamp,
               const RayTable& rays, const RayTable::Tile& tile, TileValues& values) {
  constexpr double kShininess = 400;
  const SE3 surface_T_cam = view.surface->map_T_surface.inverse() * map_T_cam;
  const Eigen::Vector3d lamp = view.surface->map_T_surface.inverse() * map_t_lamp;
  const Eigen::Vector3d& eye = surface_T_cam.translation();
  const Eigen::Matrix3d turn = surface_T_cam.rotation().matrix();
  for (int y = 0; y < tile.height; ++y) {
    for (int x = 0; x < tile.width; ++x) {
      Eigen::Vector3d cam_ray;
      for (int axis = 0; axis < 3; ++axis) {
        const float* above = rays.rays(axis, tile.y + y) + tile.x + x;
        const float* below = rays.rays(axis, tile.y + y + 1) + tile.x + x;
        cam_ray[axis] = static_cast<double>(above[0] + above[1] + below[0] + below[1]);
      }
      const Eigen::Vector3d ray = (turn * cam_ray).normalized();
      if (ray.z() < static_cast<double>(kHorizon)) continue;
      const Eigen::Vector3d at = eye - ray * (eye.z() / ray.z());
      const Eigen::Vector3d half = ((lamp - at).normalized() - ray).normalized();
      const double cosine = std::max(0.0, -half.z());
      const double shine = view.surface->finish.gloss * std::pow(cosine, kShininess);
      values[row_major(y, kTilePx, x)] += static_cast<float>(shine);
    }
  }
}

}  // namespace waymark::render
