#include "waymark/simulation/render/scene_exposure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/render/counter_noise.hpp"
#include "waymark/simulation/render/ray_table.hpp"
#include "waymark/simulation/render/surface.hpp"

namespace waymark::render {
namespace {

constexpr int kPoints = 17;

/// Whether a surface crosses the line from the eye to a point, clearly in front of the point.
bool occludes(const PreparedSurface& surface, const Eigen::Vector3d& eye, const Eigen::Vector3d& map_p) {
  constexpr double kMinGap_m = 2e-3;  // [m] in front of the point
  const Eigen::Vector3d from = surface.surface_R_map * (eye - surface.map_T_surface.translation());
  const Eigen::Vector3d to = surface.surface_R_map * (map_p - surface.map_T_surface.translation());
  if (from.z() > 0 && !surface.finish.two_sided) return false;
  if (from.z() * to.z() >= 0 || std::abs(to.z()) < kMinGap_m) return false;
  const double share = from.z() / (from.z() - to.z());
  const Eigen::Vector2d at = from.head<2>() + share * (to - from).head<2>();
  return std::abs(at.x()) <= surface.half_m.x() && std::abs(at.y()) <= surface.half_m.y();
}

class TagObserver {
 public:
  TagObserver(const SceneExposure& exposure, const CameraMotion& motion, const SE3& map_T_tag, double size_m)
      : exposure_(exposure),
        parts_(*exposure.parts),
        motion_(motion),
        map_T_tag_(map_T_tag),
        size_m_(size_m) {}

  /// Pixel of a point in the plane of the tag, at the middle of the exposure of its row.
  [[nodiscard]] std::optional<Eigen::Vector2d> pixel(const Eigen::Vector3d& map_p) const {
    auto px = parts_.model.project(exposure_.map_T_cam.inverse() * map_p);
    // each step reduces the error by the fraction of the readout in which the image moves
    constexpr int kSteps = 4;
    for (int i = 0; i < kSteps && px && exposure_.rolling; ++i) {
      const double row = std::clamp(px->y(), 0.0, static_cast<double>(parts_.model.height_px()));
      px = parts_.model.project(motion_(row_time_s(parts_, std::floor(row) + 0.5)).inverse() * map_p);
    }
    return px;
  }

  [[nodiscard]] bool is_visible(const Eigen::Vector3d& map_p,
                                const std::optional<Eigen::Vector2d>& px) const {
    if (!px || !parts_.model.contains(*px)) return false;
    const Eigen::Vector3d& eye = exposure_.map_T_cam.translation();
    for (const PreparedSurface* surface : exposure_.order) {
      if (occludes(*surface, eye, map_p)) return false;
    }
    return true;
  }

  [[nodiscard]] double visible_fraction() const {
    int visible = 0;
    for (int j = 0; j < kPoints; ++j) {
      for (int i = 0; i < kPoints; ++i) {
        const Eigen::Vector3d tag_p((i / (kPoints - 1.0) - 0.5) * size_m_,
                                    (j / (kPoints - 1.0) - 0.5) * size_m_, 0);
        const Eigen::Vector3d map_p = map_T_tag_ * tag_p;
        if (is_visible(map_p, parts_.model.project(cam_T_map_ * map_p))) ++visible;
      }
    }
    return visible / static_cast<double>(kPoints * kPoints);
  }

  [[nodiscard]] double blur_px() const {
    const double half = parts_.options.exposure_ms * 0.5e-3;
    double way = 0;
    auto last = parts_.model.project(motion_(-half).inverse() * map_T_tag_.translation());
    for (const double time : {0.0, half}) {
      const auto next = parts_.model.project(motion_(time).inverse() * map_T_tag_.translation());
      if (last && next) way += (*next - *last).norm();
      last = next;
    }
    return way;
  }

 private:
  const SceneExposure& exposure_;
  const SceneCamera::Parts& parts_;
  const CameraMotion& motion_;
  const SE3& map_T_tag_;
  double size_m_;
  SE3 cam_T_map_ = exposure_.map_T_cam.inverse();
};

std::optional<SceneTagTruth> truth_of_tag(const SceneExposure& exposure, const CameraMotion& motion,
                                          const SceneSurface& surface) {
  SceneTagTruth truth{.tag = *surface.tag, .size_m = surface.tag_size_m};
  truth.cam_T_tag = exposure.map_T_cam.inverse() * surface.map_T_surface;
  if (truth.cam_T_tag.inverse().translation().z() >= 0) return std::nullopt;  // seen from behind
  const TagObserver observer(exposure, motion, surface.map_T_surface, surface.tag_size_m);
  const auto corners = tag_corners(surface.tag_size_m);
  bool near_image = false;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3d map_p = surface.map_T_surface * corners[i];
    const auto px = observer.pixel(map_p);
    if (!px) return std::nullopt;
    truth.corners_px[i] = *px;
    truth.corner_visible[i] = observer.is_visible(map_p, px);
    near_image = near_image || exposure.parts->model.contains(*px);
  }
  const auto centre = exposure.parts->model.project(truth.cam_T_tag.translation());
  if (!near_image && !(centre && exposure.parts->model.contains(*centre))) return std::nullopt;
  truth.visible_fraction = observer.visible_fraction();
  if (truth.visible_fraction == 0) return std::nullopt;
  truth.blur_px = observer.blur_px();
  return truth;
}

}  // namespace

std::vector<SceneTagTruth> truth_of(const SceneExposure& exposure, const CameraMotion& motion) {
  std::vector<SceneTagTruth> tags;
  for (const SceneSurface& surface : exposure.parts->scene.surfaces) {
    if (!surface.tag) continue;
    if (auto truth = truth_of_tag(exposure, motion, surface)) tags.push_back(*truth);
  }
  return tags;
}

namespace {

constexpr float kHorizon = 1e-6F;
constexpr std::size_t kTilePixels = static_cast<std::size_t>(kTilePx) * kTilePx;

/// The pixel corners in a row of a tile, projected onto the plane of a surface.
struct CornerRow {
  std::array<float, kTileCorners> a, b, c;
  std::array<int, kTileCorners> column, row;  ///< column and row in the pattern
  bool horizon = false;                       ///< whether c is zero or negative anywhere
};

/// Column of a coordinate in units of cells: 0 is outside, 1 is the margin, then 2 .. cells + 1, the margin
/// and outside again. Branch-free, so that the compiler can vectorise it.
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
  int below = 0;  // using one bit per corner would prevent vectorisation
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

/// Renders the surfaces in one row of tiles.
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
    std::size_t index = 0;  ///< index in views_
    bool wholly = false;
    TileValues shade;  ///< radiance of each pixel if the surface has no pattern, otherwise that of the glare
  };

  [[nodiscard]] int rows_apart() const { return exposure_.rolling ? kTilePx : 1; }

  /// Maximum motion of the camera relative to middle_ while the rows of this band are exposed.
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

  /// The plane of a surface, as seen from each viewpoint of this band.
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
      radiance_.fill(static_cast<float>(parts_.scene.sky_reflectance));
      for (const Layer& layer : layers_) lay(layer, tile, i);
      for (std::size_t k = 0; k < kTilePixels; ++k) sum_[k] += radiance_[k];
    }
    store(tile, 1.0F / static_cast<float>(samples));
  }

  void store(const RayTable::Tile& tile, float scale) {
    for (int y = 0; y < tile.height; ++y) {
      float* to = exposure_.radiance.data() +
                  static_cast<std::size_t>(tile.y + y) * static_cast<std::size_t>(rays_.width_px()) + tile.x;
      const float* from = sum_.data() + row_major(y, kTilePx);
      for (int x = 0; x < tile.width; ++x) to[x] = from[x] * scale;
    }
  }

  void lay(const Layer& layer, const RayTable::Tile& tile, int sample) {
    const PatternGrid& grid = views_[layer.index].grid();
    if (layer.wholly && grid.cells == 0) {
      radiance_ = layer.shade;
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
    float* radiance = radiance_.data() + row_major(y, kTilePx);
    const float* shade = layer.shade.data() + row_major(y, kTilePx);
    for (int x = 0; x < width; ++x) {
      const PixelShare share = pixel(grid, top, bottom, static_cast<std::size_t>(x), horizon);
      const float own =
          grid.cells == 0 ? share.covered * shade[x] : share.level * gain + share.covered * shade[x];
      radiance[x] = radiance[x] * (1 - share.covered) + own;
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
  int last_row_ = 0;  ///< last row of the band
  SE3 middle_;
  double turn_rad_ = 0;
  double move_m_ = 0;
  std::vector<SurfaceView> views_;              ///< from far to near
  std::vector<std::vector<PlaneRays>> planes_;  ///< for each view, filled when needed
  std::vector<Layer> layers_;
  TileValues radiance_{};
  TileValues sum_{};
  std::array<CornerRow, 2> rows_;
};

/// Radiance of each pixel of a surface without a pattern or, with a pattern, the additional glare. Textures
/// are smooth, so a few samples of the exposure are enough for them, and one is enough for glare.
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

namespace {

constexpr int kLevels = 256;

/// Weights of pixels -reach .. reach with exactly the requested variance. They sample a Gaussian of a
/// different width, which is found by bisection.
std::vector<float> lens_weights(double sigma_px) {
  if (sigma_px < 0.05) return {1.0F};
  const int reach = std::max(1, static_cast<int>(std::ceil(4 * sigma_px)));
  std::vector<double> weights(static_cast<std::size_t>(2 * reach + 1));
  const auto variance_of = [&](double sigma) {
    double sum = 0;
    double squares = 0;
    for (int k = -reach; k <= reach; ++k) {
      const double w = std::exp(-k * k / (2 * sigma * sigma));
      weights[row_major(k + reach, 1)] = w;
      sum += w;
      squares += w * k * k;
    }
    for (double& w : weights) w /= sum;
    return squares / sum;
  };
  double low = 0.05;
  double high = 4 * sigma_px + 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (variance_of(middle) < sigma_px * sigma_px ? low : high) = middle;
  }
  return {weights.begin(), weights.end()};
}

/// Relative illumination by the lamps while a row is exposed: the mean of two oscillations over the exposure.
double lamp_intensity(const SceneCameraOptions& options, double time_s) {
  const auto swing = [&](double frequency_hz) {
    const double half_turn = std::numbers::pi * frequency_hz * options.exposure_ms * 1e-3;
    const double kept = half_turn > 1e-9 ? std::sin(half_turn) / half_turn : 1;
    const double turns = frequency_hz * time_s;
    return kept * std::sin(2 * std::numbers::pi * (turns - std::floor(turns)));
  };
  return 1 + options.flicker * swing(options.flicker_hz) + options.drift * swing(1 / options.drift_period_s);
}

/// Row y of the radiance, blurred down the columns. Border pixels are repeated beyond the image.
void spread_down(const SceneCamera::Parts& parts, const SceneExposure& exposure, int y,
                 std::vector<float>& out) {
  const int reach = static_cast<int>(parts.lens.size() / 2);
  const int height = parts.rays->height_px();
  const auto width = static_cast<std::size_t>(parts.rays->width_px());
  std::fill(out.begin(), out.end(), 0.0F);
  for (int k = -reach; k <= reach; ++k) {
    const int from = std::clamp(y + k, 0, height - 1);
    const float* radiance = exposure.radiance.data() + static_cast<std::size_t>(from) * width;
    const float weight = parts.lens[row_major(k + reach, 1)];
    float* to = out.data() + reach;
    for (std::size_t x = 0; x < width; ++x) to[x] += weight * radiance[x];
  }
  for (int k = 0; k < reach; ++k) {
    out[static_cast<std::size_t>(k)] = out[static_cast<std::size_t>(reach)];
    out[width + static_cast<std::size_t>(reach + k)] = out[width + static_cast<std::size_t>(reach) - 1];
  }
}

/// Scratch buffers for one band.
struct Rows {
  std::vector<float> spread, level, noise;
};

void spread_along(const std::vector<float>& weights, const std::vector<float>& from, std::vector<float>& to) {
  std::fill(to.begin(), to.end(), 0.0F);
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const float weight = weights[k];
    const float* source = from.data() + k;
    float* sum = to.data();
    for (std::size_t x = 0; x < to.size(); ++x) sum[x] += weight * source[x];
  }
}

/// Adds noise to linear grey levels. Its variance is read^2 + level x gain, with gain = 255 / full well (EMVA
/// Standard 1288, release 4, equation 9). Shot noise is approximated by a normal distribution.
void add_noise(const SceneCamera::Parts& parts, const SceneExposure& exposure, int y, Rows& rows) {
  const SceneCameraOptions& options = parts.options;
  if (options.full_well_electrons <= 0) return;
  const auto gain = static_cast<float>(255 / options.full_well_electrons);
  const auto read = static_cast<float>(options.read_noise_electrons) * gain;
  const std::size_t width = rows.level.size();
  const std::uint64_t first = static_cast<std::uint64_t>(y) * (width + width % 2);
  normals(exposure.seed, first, static_cast<int>(width), rows.noise.data());
  float* level = rows.level.data();
  const float* noise = rows.noise.data();
  for (std::size_t x = 0; x < width; ++x)
    level[x] += noise[x] * std::sqrt(read * read + gain * std::max(level[x], 0.0F));
}

void write_row(const SceneCamera::Parts& parts, const std::vector<float>& level, std::uint8_t* out) {
  if (parts.tone.empty()) {
    for (std::size_t x = 0; x < level.size(); ++x) {
      const float up =
          0.5F + std::min(std::max(level[x], 0.0F), 255.0F);  // rounds; lround would take ten times as long
      out[x] = static_cast<std::uint8_t>(up);
    }
    return;
  }
  const auto last = static_cast<float>(parts.tone.size() - 1);
  for (std::size_t x = 0; x < level.size(); ++x) {
    const float step = std::min(std::max(level[x] * kToneSteps + 0.5F, 0.0F), last);
    out[x] = parts.tone[static_cast<std::size_t>(step)];
  }
}

}  // namespace

double row_time_s(const SceneCamera::Parts& parts, double row) {
  return (row / parts.rays->height_px() - 0.5) * parts.options.readout_ms * 1e-3;
}

void prepare_sensor(SceneCamera::Parts& parts) {
  parts.lens = lens_weights(parts.options.lens_sigma_px);
  const auto width = static_cast<std::size_t>(parts.rays->width_px());
  for (int y = 0; y < parts.rays->height_px(); ++y) {
    const float* cosine = parts.rays->cosines(y);
    for (std::size_t x = 0; x < width; ++x) {
      const double fallen =
          std::pow(std::max(0.0, static_cast<double>(cosine[x])), parts.options.vignetting_power);
      parts.vignetting.push_back(cosine[x] < 0 ? 0.0F : static_cast<float>(fallen));
    }
  }
  parts.tone.clear();
  if (parts.options.gamma == 1) return;
  constexpr int kSteps = (kLevels - 1) * kToneSteps;
  for (int i = 0; i <= kSteps; ++i) {
    const double toned = 255 * std::pow(static_cast<double>(i) / kSteps, 1 / parts.options.gamma);
    parts.tone.push_back(static_cast<std::uint8_t>(std::lround(toned)));
  }
}

void read_out_band(SceneExposure& exposure, int band) {
  const SceneCamera::Parts& parts = *exposure.parts;
  const auto width = static_cast<std::size_t>(parts.rays->width_px());
  Rows rows{.spread = std::vector<float>(width + parts.lens.size() - 1),
            .level = std::vector<float>(width),
            .noise = std::vector<float>(width)};
  const int end = std::min((band + 1) * kTilePx, parts.rays->height_px());
  for (int y = band * kTilePx; y < end; ++y) {
    spread_down(parts, exposure, y, rows.spread);
    spread_along(parts.lens, rows.spread, rows.level);
    const double time_s = to_seconds(exposure.stamp.time_since_epoch()) + row_time_s(parts, y + 0.5);
    const auto white =
        static_cast<float>(parts.options.white_level_dn * lamp_intensity(parts.options, time_s));
    const float* vignetting = parts.vignetting.data() + static_cast<std::size_t>(y) * width;
    for (std::size_t x = 0; x < width; ++x) rows.level[x] *= white * vignetting[x];
    add_noise(parts, exposure, y, rows);
    write_row(parts, rows.level, exposure.image.row(y));
  }
}

}  // namespace waymark::render
