#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "waymark/simulation/row_major.hpp"
#include "waymark/simulation/scene_exposure.hpp"
#include "waymark/simulation/surface_shade.hpp"

namespace waymark::render {
namespace {

constexpr float kHorizon = 1e-6F;
constexpr std::size_t kTilePixels = static_cast<std::size_t>(kTilePx) * kTilePx;

/// The pixel corners of a row of a tile, on the plane of a surface.
struct CornerRow {
  std::array<float, kTileCorners> a, b, c;
  std::array<int, kTileCorners> column, row;  ///< of the pattern
  bool horizon = false;                       ///< whether c is not above 0 everywhere
};

/// Column of a coordinate in units of cells: 0 outside, 1 margin, 2 .. cells + 1, margin, outside. Without
/// branches, so that it goes four at a time.
template <bool kHasCells>
int strip_of(float u, float low, float high, int cells) {
  const int past_low = static_cast<int>(u >= low);
  const int past_high = static_cast<int>(u >= high);
  if constexpr (!kHasCells) return past_low + past_high;
  const float inside = std::max(-1.0F, std::min(u, static_cast<float>(cells)));
  const int strip = static_cast<int>(inside + 1.0F) + 1;
  return strip * (past_low - past_high) + (cells + 3) * past_high;
}

template <bool kHasCells>
void find_strips(const PatternGrid& grid, int count, CornerRow& out) {
  const float left = grid.left, right = grid.right, top = grid.top, bottom = grid.bottom;
  const int cells = grid.cells;
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const float reciprocal = 1 / std::max(out.c[k], kHorizon);
    out.column[k] = strip_of<kHasCells>(out.a[k] * reciprocal, left, right, cells);
    out.row[k] = strip_of<kHasCells>(out.b[k] * reciprocal, top, bottom, cells);
  }
}

void meet_corners(const RayTable& rays, const PlaneRays& plane, const PatternGrid& grid, int x, int y,
                  int count, CornerRow& out) {
  const float* rx = rays.rays(0, y) + x;
  const float* ry = rays.rays(1, y) + x;
  const float* rz = rays.rays(2, y) + x;
  int below = 0;  // a bit per corner would not go four at a time
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    out.a[k] = plane.a.shift + plane.a.x * rx[i] + plane.a.y * ry[i] + plane.a.z * rz[i];
    out.b[k] = plane.b.shift + plane.b.x * rx[i] + plane.b.y * ry[i] + plane.b.z * rz[i];
    out.c[k] = plane.c.shift + plane.c.x * rx[i] + plane.c.y * ry[i] + plane.c.z * rz[i];
    below |= static_cast<int>(out.c[k] < kHorizon);
  }
  out.horizon = below != 0;
  grid.cells > 0 ? find_strips<true>(grid, count, out) : find_strips<false>(grid, count, out);
}

/// Paints the surfaces of one row of tiles.
class BandPainter {
 public:
  BandPainter(SceneExposure& exposure, int band)
      : exposure_(exposure), parts_(*exposure.parts), rays_(*parts_.rays), band_(band) {
    last_row_ = std::min(band * kTilePx + kTilePx, rays_.height_px()) - 1;
    const int middle_row = (band * kTilePx + last_row_) / 2;
    middle_ = exposure.rolling ? exposure.pose(middle_row, exposure.samples / 2) : exposure.map_T_cam;
    measure_motion();
    for (const PreparedSurface* surface : exposure.order) views_.push_back(view_of(*surface, middle_));
    planes_.resize(views_.size());
  }

  void paint() {
    for (int column = 0; column < rays_.tile_columns(); ++column) {
      const RayTable::Tile& tile = rays_.tile(column, band_);
      if (tile.sees) paint(tile);
    }
  }

 private:
  struct Layer {
    std::size_t index = 0;  ///< in views_
    bool wholly = false;
    TileValues shade;  ///< light of each pixel, of a surface without a pattern; else of glare
  };

  [[nodiscard]] int rows_apart() const { return exposure_.rolling ? kTilePx : 1; }

  /// How far the camera gets from middle_ while the rows of this band are exposed.
  void measure_motion() {
    const int first = band_ * kTilePx;
    const int last = exposure_.rolling ? last_row_ : first;
    for (int row = first; row <= last; ++row) {
      for (int i = 0; i < exposure_.samples; ++i) {
        const SE3& pose = exposure_.pose(row, i);
        turn_rad_ = std::max(turn_rad_, (middle_.rotation().inverse() * pose.rotation()).angle());
        move_m_ = std::max(move_m_, (pose.translation() - middle_.translation()).norm());
      }
    }
    const double radius = parts_.options.aperture_mm * 0.5e-3;
    move_m_ += radius;
    turn_rad_ += radius / parts_.options.focus_distance_m;
  }

  /// The plane of a surface from every viewpoint of this band.
  const PlaneRays& plane(std::size_t index, int row, int sample) {
    std::vector<PlaneRays>& planes = planes_[index];
    if (planes.empty()) {
      for (int r = 0; r < rows_apart(); ++r) {
        const int y = std::min(band_ * kTilePx + r, last_row_);
        for (int i = 0; i < exposure_.samples; ++i) planes.push_back(plane_from(index, y, i));
      }
    }
    const int r = exposure_.rolling ? row - band_ * kTilePx : 0;
    return planes[row_major(r, exposure_.samples, sample)];
  }

  [[nodiscard]] PlaneRays plane_from(std::size_t index, int y, int sample) const {
    const SE3& map_T_cam = exposure_.pose(y, sample);
    const Eigen::Vector3d& lens = exposure_.cam_t_lens[static_cast<std::size_t>(sample)];
    const Viewpoint view{.map_R_cam = map_T_cam.rotation().matrix(),
                         .map_t_lens = map_T_cam * lens,
                         .cam_ray_shift = -lens / parts_.options.focus_distance_m};
    return plane_rays(*views_[index].surface, views_[index].front, view);
  }

  void paint(const RayTable::Tile& tile) {
    layers_.clear();
    for (std::size_t i = views_.size(); i-- > 0;) {
      const Meeting meeting = meets(views_[i], tile, turn_rad_, move_m_);
      if (meeting == Meeting::None) continue;
      layers_.push_back({.index = i, .wholly = meeting == Meeting::Wholly, .shade = {}});
      if (meeting == Meeting::Wholly) break;
    }
    std::reverse(layers_.begin(), layers_.end());
    for (Layer& layer : layers_) shade(layer, tile);
    const bool still = std::all_of(layers_.begin(), layers_.end(), [&](const Layer& layer) {
      return layer.wholly && views_[layer.index].grid().cells == 0;
    });
    const int samples = still ? 1 : exposure_.samples;
    sum_.fill(0);
    for (int i = 0; i < samples; ++i) {
      light_.fill(static_cast<float>(parts_.scene.sky_reflectance));
      for (const Layer& layer : layers_) lay(layer, tile, i);
      for (std::size_t k = 0; k < kTilePixels; ++k) sum_[k] += light_[k];
    }
    store(tile, 1.0F / static_cast<float>(samples));
  }

  void store(const RayTable::Tile& tile, float scale) {
    for (int y = 0; y < tile.height; ++y) {
      float* to = exposure_.light.data() +
                  static_cast<std::size_t>(tile.y + y) * static_cast<std::size_t>(rays_.width_px()) + tile.x;
      const float* from = sum_.data() + row_major(y, kTilePx);
      for (int x = 0; x < tile.width; ++x) to[x] = from[x] * scale;
    }
  }

  void lay(const Layer& layer, const RayTable::Tile& tile, int sample) {
    const PatternGrid& grid = views_[layer.index].grid();
    if (layer.wholly && grid.cells == 0) {
      light_ = layer.shade;
      return;
    }
    CornerRow* top = &rows_[0];
    CornerRow* bottom = &rows_[1];
    const int count = tile.width + 1;
    for (int y = 0; y < tile.height; ++y) {
      const PlaneRays& from = plane(layer.index, tile.y + y, sample);
      if (y == 0 || exposure_.rolling) meet_corners(rays_, from, grid, tile.x, tile.y + y, count, *top);
      meet_corners(rays_, from, grid, tile.x, tile.y + y + 1, count, *bottom);
      lay_row(layer, grid, *top, *bottom, tile.width, y);
      std::swap(top, bottom);
    }
  }

  void lay_row(const Layer& layer, const PatternGrid& grid, const CornerRow& top, const CornerRow& bottom,
               int width, int y) {
    const SurfaceView& view = views_[layer.index];
    const auto gain = static_cast<float>(view.front ? view.surface->gain_front : view.surface->gain_back);
    const bool horizon = top.horizon || bottom.horizon;
    float* light = light_.data() + row_major(y, kTilePx);
    const float* shade = layer.shade.data() + row_major(y, kTilePx);
    for (int x = 0; x < width; ++x) {
      const PixelShare share = pixel(grid, top, bottom, static_cast<std::size_t>(x), horizon);
      const float own =
          grid.cells == 0 ? share.covered * shade[x] : share.level * gain + share.covered * shade[x];
      light[x] = light[x] * (1 - share.covered) + own;
    }
  }

  static PixelShare pixel(const PatternGrid& grid, const CornerRow& top, const CornerRow& bottom,
                          std::size_t x, bool horizon) {
    const int column = top.column[x];
    const int row = top.row[x];
    const int differ =
        ((top.column[x + 1] ^ column) | (bottom.column[x] ^ column) | (bottom.column[x + 1] ^ column)) |
        ((top.row[x + 1] ^ row) | (bottom.row[x] ^ row) | (bottom.row[x + 1] ^ row));
    if (differ == 0 && !horizon) return {grid.covers(row, column) ? 1.0F : 0.0F, grid.level(row, column)};
    const PlanePoint corners[4] = {{top.a[x], top.b[x], top.c[x]},
                                   {top.a[x + 1], top.b[x + 1], top.c[x + 1]},
                                   {bottom.a[x + 1], bottom.b[x + 1], bottom.c[x + 1]},
                                   {bottom.a[x], bottom.b[x], bottom.c[x]}};
    CellSpan span{std::min({column, top.column[x + 1], bottom.column[x], bottom.column[x + 1]}),
                  std::max({column, top.column[x + 1], bottom.column[x], bottom.column[x + 1]}),
                  std::min({row, top.row[x + 1], bottom.row[x], bottom.row[x + 1]}),
                  std::max({row, top.row[x + 1], bottom.row[x], bottom.row[x + 1]})};
    if (horizon) {
      const bool near = std::min({corners[0].c, corners[1].c, corners[2].c, corners[3].c}) < kHorizon;
      if (near) span = {0, grid.lines(), 0, grid.lines()};
    }
    const bool outside = span.column_high == 0 || span.row_high == 0 || span.column_low == grid.lines() ||
                         span.row_low == grid.lines();
    return outside ? PixelShare{} : share_of_pixel(grid, corners, span);
  }

  void shade(Layer& layer, const RayTable::Tile& tile);

  SceneExposure& exposure_;
  const SceneCamera::Parts& parts_;
  const RayTable& rays_;
  int band_;
  int last_row_ = 0;  ///< of the band
  SE3 middle_;
  double turn_rad_ = 0;
  double move_m_ = 0;
  std::vector<SurfaceView> views_;              ///< from far to near
  std::vector<std::vector<PlaneRays>> planes_;  ///< of each view, as needed
  std::vector<Layer> layers_;
  TileValues light_{};
  TileValues sum_{};
  std::array<CornerRow, 2> rows_;
};

/// Light of each pixel of a surface without a pattern; of one with a pattern, what is added to it. Textures
/// are smooth: a few moments of the exposure are enough for them, and one for glare.
void BandPainter::shade(Layer& layer, const RayTable::Tile& tile) {
  constexpr int kSamplesApart = 4;
  const SurfaceView& view = views_[layer.index];
  const Finish& finish = view.surface->finish;
  const bool plain = view.grid().cells == 0;
  const double mean = finish.reflectance * (view.front ? view.surface->gain_front : view.surface->gain_back);
  layer.shade.fill(plain ? static_cast<float>(mean) : 0.0F);
  if (plain && finish.contrast > 0 && finish.texture > 0) {
    const int count = (exposure_.samples + kSamplesApart - 1) / kSamplesApart;
    TileNodes nodes{};
    for (int i = 0; i < count; ++i) {
      const int sample = (2 * i + 1) * exposure_.samples / (2 * count);
      for (int node = 0; node < kTileNodes; ++node) {
        const PlaneRays& from = plane(layer.index, std::min(tile.y + 2 * node, last_row_), sample);
        add_texture_nodes(surface_texture(finish.texture), finish.cell_m, from, rays_, tile, node, nodes);
      }
    }
    spread_nodes(nodes, static_cast<float>(finish.contrast * mean / count), layer.shade);
  }
  if (finish.gloss > 0 && view.front)
    add_glare(view, middle_, parts_.scene.map_t_lamp, rays_, tile, layer.shade);
}

}  // namespace

void expose_band(SceneExposure& exposure, int band) { BandPainter(exposure, band).paint(); }

}  // namespace waymark::render
