#pragma once

#include <array>

#include "waymark/simulation/ray_table.hpp"
#include "waymark/simulation/surface_texture.hpp"
#include "waymark/simulation/surface_view.hpp"

namespace waymark::render {

/// A value for each pixel of a tile, row by row.
using TileValues = std::array<float, static_cast<std::size_t>(kTilePx) * kTilePx>;

/// The texture at every other corner of a tile's pixels, in both directions.
inline constexpr int kTileNodes = kTilePx / 2 + 1;
using TileNodes = std::array<float, static_cast<std::size_t>(kTileNodes) * kTileNodes>;

/// Adds row `node` (pixel corners 2 node) of the nodes of a tile that sees a texture so, filtered to two
/// pixels.
void add_texture_nodes(const SurfaceTexture& texture, double cell_m, const PlaneRays& plane,
                       const RayTable& rays, const RayTable::Tile& tile, int node, TileNodes& nodes);

/// Adds `scale` times what lies between the nodes (bilinear) to every pixel.
void spread_nodes(const TileNodes& nodes, float scale, TileValues& values);

/// Adds the mirror image of the lamp on a glossy surface (Blinn, "Models of light reflection for computer
/// synthesized pictures", SIGGRAPH 1977: the cosine between the normal and the middle of the ways to lamp and
/// camera, to a power).
void add_glare(const SurfaceView& view, const SE3& map_T_cam, const Eigen::Vector3d& map_t_lamp,
               const RayTable& rays, const RayTable::Tile& tile, TileValues& values);

}  // namespace waymark::render
