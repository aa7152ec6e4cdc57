#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "waymark/simulation/render/ray_table.hpp"
#include "waymark/simulation/render/scene.hpp"

namespace waymark::render {

/// The pattern of a flat rectangle: square cells in the middle, a margin around them, and nothing outside.
/// Coordinates are in units of a cell, with the origin at the top left corner of the cells. A plain rectangle
/// has no cells, and its units are arbitrary. In either direction, lines 0 .. lines() - 1 separate columns
/// (rows) 0 .. lines(); the first and the last column (row) are outside.
struct PatternGrid {
  int cells = 0;  ///< number of cells per row; at most kMaxCells
  float left = 0, right = 0, top = 0, bottom = 0;
  std::vector<float> levels;  ///< reflectance of row r, column c at index r * (lines() + 1) + c; 0 outside

  static constexpr int kMaxCells = 16;

  [[nodiscard]] int lines() const { return cells > 0 ? cells + 3 : 2; }
  [[nodiscard]] float column_line(int k) const {
    return k == 0 ? left : (k == lines() - 1 ? right : static_cast<float>(k - 1));
  }
  [[nodiscard]] float row_line(int k) const {
    return k == 0 ? top : (k == lines() - 1 ? bottom : static_cast<float>(k - 1));
  }
  [[nodiscard]] float level(int row, int column) const { return levels[row_major(row, lines() + 1, column)]; }
  [[nodiscard]] bool covers(int row, int column) const {
    return row > 0 && column > 0 && row < lines() && column < lines();
  }
};

/// Intersection of the line of sight through a pixel corner with the plane: (a / c, b / c), which is in front
/// of the camera if c > 0.
struct PlanePoint {
  float a = 0, b = 0, c = 0;
};

/// The columns and rows that a pixel may overlap.
struct CellSpan {
  int column_low = 0, column_high = 0, row_low = 0, row_high = 0;
};

/// Fraction of a pixel that a pattern covers, and the sum of reflectance times fraction.
struct PixelShare {
  float covered = 0;
  float level = 0;
};

/// Computes exact areas by cutting the pixel square along the lines of the pattern. This assumes that a, b
/// and c are linear between the corners, which is exact without distortion. With distortion, the error is the
/// curvature within a pixel. Corners are in clockwise order, starting at the top left. At some of them, c may
/// be zero or negative (the horizon). O(cells touched).
[[nodiscard]] PixelShare share_of_pixel(const PatternGrid& grid, const PlanePoint (&corners)[4],
                                        const CellSpan& span);

/// A surface prepared for rendering.
struct PreparedSurface {
  SE3 map_T_surface{};
  Eigen::Matrix3d surface_R_map = Eigen::Matrix3d::Identity();
  std::array<Eigen::Vector3d, 4> map_p_corners{};  ///< corners TL, TR, BR, BL
  Eigen::Vector2d half_m = Eigen::Vector2d::Zero();
  PatternGrid front{};
  PatternGrid back{};  ///< a blank grid for the back
  double unit_m = 1;   ///< side length of a grid unit
  Finish finish{};
  double gain_front = 1, gain_back = 1;  ///< illumination of each side
};

[[nodiscard]] PreparedSurface prepare(const SceneSurface& surface, const Scene& scene, double ambient);

/// Pose of the camera for one sample of the exposure, through one point on its lens.
struct Viewpoint {
  Eigen::Matrix3d map_R_cam = Eigen::Matrix3d::Identity();
  Eigen::Vector3d map_t_lens = Eigen::Vector3d::Zero();  ///< the point on the lens
  /// Added to every ray for a point away from the centre of the lens: minus its offset divided by the focus
  /// distance.
  Eigen::Vector3d cam_ray_shift = Eigen::Vector3d::Zero();
};

/// A surface as seen from a viewpoint. A ray r intersects its plane at (a / c, b / c), in units of its grid.
/// Each of a, b and c is x r.x + y r.y + z r.z + shift.
struct PlaneRays {
  struct Form {
    float x = 0, y = 0, z = 0, shift = 0;
  };
  Form a{}, b{}, c{};
};

[[nodiscard]] PlaneRays plane_rays(const PreparedSurface& surface, bool front, const Viewpoint& view);

/// A surface relative to the camera in the middle of the exposure.
struct SurfaceView {
  const PreparedSurface* surface = nullptr;
  bool front = true;
  double nearest_m = 0;                          ///< distance to the nearest point of the surface
  std::array<Eigen::Vector3d, 4> cam_n_edges{};  ///< unit; a ray inside all four intersects the surface

  [[nodiscard]] const PatternGrid& grid() const { return front ? surface->front : surface->back; }
};

[[nodiscard]] SurfaceView view_of(const PreparedSurface& surface, const SE3& map_T_cam);

/// The surfaces that may be visible to a camera, farthest first; each is drawn over the previous ones. Uses
/// pairwise tests of planes (Newell, Newell and Sancha, "A solution to the hidden surface problem", ACM
/// 1972). Surfaces that intersect, or cover each other cyclically, are not handled correctly. Surfaces are
/// omitted if the camera is within 1 mm of their plane. O(surfaces squared).
[[nodiscard]] std::vector<const PreparedSurface*> from_far_to_near(std::span<const PreparedSurface> surfaces,
                                                                   const SE3& map_T_cam,
                                                                   double half_view_rad);

enum class Meeting : std::uint8_t { None, Partly, Wholly };

/// Whether a surface fills a tile, misses it, or neither is certain, while the camera rotates by up to
/// `turn_rad` and moves by up to `move_m` relative to the view.
[[nodiscard]] Meeting meets(const SurfaceView& view, const RayTable::Tile& tile, double turn_rad,
                            double move_m);

/// A texture that repeats in both directions, stored at full, half, quarter, … size (Williams, "Pyramidal
/// parametrics", SIGGRAPH 1983). Values are from -1 to 1 with mean 0.
class SurfaceTexture {
 public:
  /// `kind` is an index into kFloorTextures. Kinds differ in contents, not in size.
  explicit SurfaceTexture(int kind);

  /// Number of cells (tiles, planks, largest blobs) per repetition.
  static constexpr int kCells = 8;
  /// Number of texels per cell at the finest level.
  static constexpr int kTexelsPerCell = 64;

  /// The two levels closest in size to a footprint given in texels of the finest level.
  struct Level {
    const float* fine = nullptr;
    const float* coarse = nullptr;
    int fine_size = 1, coarse_size = 1;  ///< [texel], a power of 2
    float to_coarse = 0;                 ///< weight of the coarser level
  };
  [[nodiscard]] Level level(double texels) const;

  /// The value at (u, v) [cells].
  [[nodiscard]] static float at(const Level& level, float u, float v);

 private:
  [[nodiscard]] const float* texels(std::size_t level) const { return levels_[level].data(); }
  std::vector<std::vector<float>> levels_;
};

/// Created on first use and then shared. Thread-safe.
[[nodiscard]] const SurfaceTexture& surface_texture(int kind);

/// A value for each pixel of a tile, row by row.
using TileValues = std::array<float, static_cast<std::size_t>(kTilePx) * kTilePx>;

/// The texture is evaluated at every other pixel corner of a tile, in both directions.
inline constexpr int kTileNodes = kTilePx / 2 + 1;
using TileNodes = std::array<float, static_cast<std::size_t>(kTileNodes) * kTileNodes>;

/// Adds row `node` of the nodes of a tile (pixel corners in row 2 node), with the texture filtered to two
/// pixels.
void add_texture_nodes(const SurfaceTexture& texture, double cell_m, const PlaneRays& plane,
                       const RayTable& rays, const RayTable::Tile& tile, int node, TileNodes& nodes);

/// Adds the bilinear interpolation of the nodes, multiplied by `scale`, to every pixel.
void spread_nodes(const TileNodes& nodes, float scale, TileValues& values);

/// Adds the specular reflection of the lamp on a glossy surface (Blinn, "Models of light reflection for
/// computer synthesized pictures", SIGGRAPH 1977). It is a power of the cosine between the normal and the
/// bisector of the directions to lamp and camera.
void add_glare(const SurfaceView& view, const SE3& map_T_cam, const Eigen::Vector3d& map_t_lamp,
               const RayTable& rays, const RayTable::Tile& tile, TileValues& values);

}  // namespace waymark::render
