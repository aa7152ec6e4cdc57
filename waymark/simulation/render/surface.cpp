#include "waymark/simulation/render/surface.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

#include "waymark/simulation/render/counter_noise.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark::render {
namespace {

constexpr float kMinFaceDepth = 1e-6F;
constexpr std::size_t kMaxColumns = PatternGrid::kMaxCells + 6;

/// A corner of a piece of the pixel, with its position both in the pixel and on the plane.
struct Vertex {
  float x = 0, y = 0;
  float a = 0, b = 0, c = 0;
};

/// A convex piece. Cutting the square along the horizon and along parallel lines in two directions gives at
/// most seven corners; rounding may add a few more.
struct Piece {
  std::array<Vertex, 16> vertices;
  std::size_t count = 0;

  void add(const Vertex& vertex) {
    if (count < vertices.size()) vertices[count++] = vertex;
  }
};

Vertex between(const Vertex& p, const Vertex& q, float t) {
  return {p.x + t * (q.x - p.x), p.y + t * (q.y - p.y), p.a + t * (q.a - p.a), p.b + t * (q.b - p.b),
          p.c + t * (q.c - p.c)};
}

/// The part of the piece in which `side` is not negative (Sutherland and Hodgman, "Reentrant polygon
/// clipping", CACM 1974).
template <class Side>
void cut(const Piece& from, const Side& side, Piece& to) {
  to.count = 0;
  if (from.count == 0) return;
  const Vertex* last = &from.vertices[from.count - 1];
  float last_side = side(*last);
  for (std::size_t i = 0; i < from.count; ++i) {
    const Vertex& next = from.vertices[i];
    const float next_side = side(next);
    if ((last_side >= 0) != (next_side >= 0))
      to.add(between(*last, next, last_side / (last_side - next_side)));
    if (next_side >= 0) to.add(next);
    last = &next;
    last_side = next_side;
  }
}

/// Shoelace formula, relative to the first corner.
float area(const Piece& piece) {
  float twice = 0;
  for (std::size_t i = 2; i < piece.count; ++i) {
    const Vertex& o = piece.vertices[0];
    const Vertex& p = piece.vertices[i - 1];
    const Vertex& q = piece.vertices[i];
    twice += (p.x - o.x) * (q.y - o.y) - (p.y - o.y) * (q.x - o.x);
  }
  return twice / 2;
}

/// Fraction of the pixel square in which a value that is linear between the corners is not negative.
float share_of_square(const float (&f)[4]) {
  constexpr float kX[5] = {0, 1, 1, 0, 0};
  constexpr float kY[5] = {0, 0, 1, 1, 0};
  float twice = 0;
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  int count = 0;
  const auto add = [&](float x, float y) {
    if (count == 0) {
      x0 = x;
      y0 = y;
    } else if (count > 1) {
      twice += (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0);
    }
    x1 = x;
    y1 = y;
    ++count;
  };
  for (int i = 0; i < 4; ++i) {
    const float here = f[i];
    const float next = f[(i + 1) & 3];
    if (here >= 0) add(kX[i], kY[i]);
    if ((here >= 0) != (next >= 0)) {
      const float t = here / (here - next);
      add(kX[i] + t * (kX[i + 1] - kX[i]), kY[i] + t * (kY[i + 1] - kY[i]));
    }
  }
  return twice / 2;
}

PixelShare of_cell(const PatternGrid& grid, int row, int column) {
  return {grid.covers(row, column) ? 1.0F : 0.0F, grid.level(row, column)};
}

/// A pixel crossed by one line; the fraction `beyond` lies past that line.
PixelShare mixed(const PixelShare& before, const PixelShare& after, float beyond) {
  return {before.covered + beyond * (after.covered - before.covered),
          before.level + beyond * (after.level - before.level)};
}

/// The area of the pixel past column line i and row line j, for all i and j in the span. The areas of cells
/// are differences between these values.
class PastLines {
 public:
  PastLines(const PatternGrid& grid, const PlanePoint (&corners)[4], const CellSpan& span)
      : grid_(grid), span_(span) {
    constexpr float kX[4] = {0, 1, 1, 0};
    constexpr float kY[4] = {0, 0, 1, 1};
    bool horizon = false;
    for (std::size_t i = 0; i < 4; ++i) {
      column_.add({kX[i], kY[i], corners[i].a, corners[i].b, corners[i].c});
      horizon = horizon || corners[i].c < kMinFaceDepth;
    }
    if (!horizon) return;
    cut(
        column_, [](const Vertex& v) { return v.c - kMinFaceDepth; }, spare_);
    column_ = spare_;
  }

  PixelShare sum() {
    PixelShare total;
    Areas now{};
    Areas next{};
    fill(now);
    for (int column = span_.column_low; column <= span_.column_high; ++column) {
      next.fill(0);
      if (column < span_.column_high) {
        cut_at_column(column);
        fill(next);
      }
      add_column(column, now, next, total);
      now = next;
    }
    return total;
  }

 private:
  using Areas = std::array<float, kMaxColumns>;

  void cut_at_column(int column) {
    const float line = grid_.column_line(column);
    cut(
        column_, [line](const Vertex& v) { return v.a - line * v.c; }, spare_);
    column_ = spare_;
  }

  void fill(Areas& areas) {
    Piece piece = column_;
    areas[0] = area(piece);
    for (int row = span_.row_low; row < span_.row_high; ++row) {
      const float line = grid_.row_line(row);
      cut(
          piece, [line](const Vertex& v) { return v.b - line * v.c; }, spare_);
      piece = spare_;
      areas[row_major(row - span_.row_low, 1, 1)] = area(piece);
    }
  }

  void add_column(int column, const Areas& now, const Areas& next, PixelShare& total) const {
    for (int row = span_.row_low; row <= span_.row_high; ++row) {
      const auto i = static_cast<std::size_t>(row - span_.row_low);
      const bool last = row == span_.row_high;
      const float here = (now[i] - next[i]) - (last ? 0.0F : now[i + 1] - next[i + 1]);
      const PixelShare cell = of_cell(grid_, row, column);
      total.covered += here * cell.covered;
      total.level += here * cell.level;
    }
  }

  const PatternGrid& grid_;
  const CellSpan& span_;
  Piece column_;
  Piece spare_;
};

}  // namespace

PixelShare share_of_pixel(const PatternGrid& grid, const PlanePoint (&corners)[4], const CellSpan& span) {
  assert(grid.cells <= PatternGrid::kMaxCells);
  const int columns = span.column_high - span.column_low;
  const int rows = span.row_high - span.row_low;
  if (columns + rows > 1) return PastLines(grid, corners, span).sum();
  const PixelShare before = of_cell(grid, span.row_low, span.column_low);
  const PixelShare after = of_cell(grid, span.row_high, span.column_high);
  if (before.covered == after.covered && before.level == after.level) return before;
  float past[4];
  if (columns == 1) {
    const float line = grid.column_line(span.column_low);
    for (std::size_t i = 0; i < 4; ++i) past[i] = corners[i].a - line * corners[i].c;
  } else {
    const float line = grid.row_line(span.row_low);
    for (std::size_t i = 0; i < 4; ++i) past[i] = corners[i].b - line * corners[i].c;
  }
  return mixed(before, after, share_of_square(past));
}

namespace {

constexpr double kSamePlaneM = 2e-3;  // points closer to a plane count as lying in it
constexpr double kMaxConeRad = 1.2;   // [rad] beyond this, a cone about the middle is not a valid bound
constexpr double kInk = 0.06;
constexpr std::uint8_t kInkCell = 0;

PatternGrid blank_grid(const Eigen::Vector2d& half_m, double level) {
  PatternGrid grid;
  grid.left = static_cast<float>(-half_m.x());
  grid.right = static_cast<float>(half_m.x());
  grid.top = static_cast<float>(-half_m.y());
  grid.bottom = static_cast<float>(half_m.y());
  grid.levels.assign(9, 0);
  grid.levels[4] = static_cast<float>(level);
  return grid;
}

PatternGrid tag_grid(const TagId& tag, const Eigen::Vector2d& half_m, double cell_m, double paper) {
  PatternGrid grid;
  grid.cells = family(tag.family).total_width;
  const double middle = grid.cells / 2.0;
  const double paper_beyond = 1e-5;  // avoids a sliver if the paper ends at the edge of the tag
  const Eigen::Vector2d half = (half_m / cell_m).cwiseMax(middle + paper_beyond);
  grid.left = static_cast<float>(middle - half.x());
  grid.right = static_cast<float>(middle + half.x());
  grid.top = static_cast<float>(middle - half.y());
  grid.bottom = static_cast<float>(middle + half.y());
  const int across = grid.lines() + 1;
  grid.levels.assign(static_cast<std::size_t>(across) * static_cast<std::size_t>(across), 0);
  const std::vector<std::uint8_t> print = bitmap(tag);
  for (int row = 1; row < across - 1; ++row) {
    for (int column = 1; column < across - 1; ++column) {
      const int x = column - 2;
      const int y = row - 2;
      const bool on_tag = x >= 0 && y >= 0 && x < grid.cells && y < grid.cells;
      const bool ink = on_tag && print[row_major(y, grid.cells, x)] == kInkCell;
      grid.levels[row_major(row, across, column)] = static_cast<float>(ink ? kInk * paper : paper);
    }
  }
  return grid;
}

PlaneRays::Form form(const Eigen::RowVector3d& row, const Eigen::Vector3d& shift) {
  return {static_cast<float>(row.x()), static_cast<float>(row.y()), static_cast<float>(row.z()),
          static_cast<float>(row.dot(shift))};
}

/// Data of a surface that are needed for sorting.
struct Placed {
  const PreparedSurface* surface = nullptr;
  bool front = true;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit vector from the camera to its middle
  double angle_rad = 0;  ///< angle between that direction and its farthest corner
  double distance_m = 0;
};

Eigen::Vector3d towards_camera(const Placed& p) {
  const Eigen::Vector3d into = p.surface->surface_R_map.row(2).transpose();
  return p.front ? Eigen::Vector3d(-into) : into;
}

/// Whether p could hide part of q.
bool may_hide(const Placed& p, const Placed& q) {
  const auto height_over = [](const Placed& plane, const Eigen::Vector3d& point) {
    return towards_camera(plane).dot(point - plane.surface->map_p_corners[0]);
  };
  const auto& of_p = p.surface->map_p_corners;
  const auto& of_q = q.surface->map_p_corners;
  const bool before_q =
      std::any_of(of_p.begin(), of_p.end(), [&](const auto& c) { return height_over(q, c) > kSamePlaneM; });
  const bool q_behind =
      std::any_of(of_q.begin(), of_q.end(), [&](const auto& c) { return height_over(p, c) < -kSamePlaneM; });
  return before_q && q_behind;
}

bool in_one_plane(const Placed& p, const Placed& q) {
  return std::all_of(p.surface->map_p_corners.begin(), p.surface->map_p_corners.end(), [&](const auto& c) {
    return std::abs(towards_camera(q).dot(c - q.surface->map_p_corners[0])) <= kSamePlaneM;
  });
}

/// Whether p (earlier in the scene than q) must be drawn before q, after it, or in either order.
int order_of(const Placed& p, const Placed& q) {
  const bool small = p.angle_rad < kMaxConeRad && q.angle_rad < kMaxConeRad;
  if (small && std::acos(std::clamp(p.direction.dot(q.direction), -1.0, 1.0)) > p.angle_rad + q.angle_rad)
    return 0;
  const bool p_hides = may_hide(p, q);
  const bool q_hides = may_hide(q, p);
  if (p_hides && q_hides) return p.distance_m > q.distance_m ? -1 : 1;
  if (p_hides) return 1;
  if (q_hides) return -1;
  return in_one_plane(p, q) ? -1 : 0;
}

Placed place(const PreparedSurface& surface, const Eigen::Vector3d& map_t_cam, bool front) {
  Placed placed{.surface = &surface, .front = front};
  const Eigen::Vector3d to_middle = surface.map_T_surface.translation() - map_t_cam;
  placed.distance_m = to_middle.norm();
  placed.direction = to_middle.normalized();
  for (const Eigen::Vector3d& corner : surface.map_p_corners) {
    const Eigen::Vector3d ray = corner - map_t_cam;
    placed.angle_rad =
        std::max(placed.angle_rad, std::atan2(ray.cross(placed.direction).norm(), ray.dot(placed.direction)));
  }
  return placed;
}

/// Repeatedly selects the first surface that no remaining one must precede.
std::vector<const PreparedSurface*> sorted(const std::vector<Placed>& placed) {
  const std::size_t n = placed.size();
  std::vector<std::uint8_t> before(n * n, 0);  // before[i * n + j]: whether i must be drawn before j
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      const int order = order_of(placed[i], placed[j]);
      if (order < 0) before[i * n + j] = 1;
      if (order > 0) before[j * n + i] = 1;
    }
  }
  std::vector<std::uint8_t> done(n, 0);
  std::vector<const PreparedSurface*> order;
  while (order.size() < n) {
    std::size_t next = n;
    std::size_t farthest = n;
    for (std::size_t j = 0; j < n && next == n; ++j) {
      if (done[j] != 0) continue;
      if (farthest == n || placed[j].distance_m > placed[farthest].distance_m) farthest = j;
      bool free = true;
      for (std::size_t i = 0; i < n && free; ++i) free = done[i] != 0 || before[i * n + j] == 0;
      if (free) next = j;
    }
    if (next == n) next = farthest;  // there is a cycle
    done[next] = 1;
    order.push_back(placed[next].surface);
  }
  return order;
}

}  // namespace

PreparedSurface prepare(const SceneSurface& surface, const Scene& scene, double ambient) {
  PreparedSurface prepared;
  prepared.map_T_surface = surface.map_T_surface;
  prepared.surface_R_map = surface.map_T_surface.rotation().matrix().transpose();
  prepared.half_m = {surface.width_m / 2, surface.height_m / 2};
  const double signs[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d corner(signs[i][0] * prepared.half_m.x(), signs[i][1] * prepared.half_m.y(), 0);
    prepared.map_p_corners[i] = surface.map_T_surface * corner;
  }
  prepared.finish = surface.finish;
  prepared.back = blank_grid(prepared.half_m, surface.finish.reflectance);
  prepared.front = prepared.back;
  if (surface.tag) {
    prepared.unit_m = surface.tag_size_m / family(surface.tag->family).width_at_border;
    prepared.front = tag_grid(*surface.tag, prepared.half_m, prepared.unit_m, surface.finish.reflectance);
    prepared.back = blank_grid(prepared.half_m / prepared.unit_m, surface.finish.reflectance);
  }
  const Eigen::Vector3d to_lamp = (scene.map_t_lamp - surface.map_T_surface.translation()).normalized();
  const double lit = -prepared.surface_R_map.row(2).dot(to_lamp);
  prepared.gain_front = ambient + (1 - ambient) * std::max(0.0, lit);
  prepared.gain_back = ambient + (1 - ambient) * std::max(0.0, -lit);
  return prepared;
}

PlaneRays plane_rays(const PreparedSurface& surface, bool front, const Viewpoint& view) {
  const Eigen::Vector3d eye = surface.surface_R_map * (view.map_t_lens - surface.map_T_surface.translation());
  Eigen::Matrix3d surface_R_cam = surface.surface_R_map * view.map_R_cam;
  if (!front) surface_R_cam = -surface_R_cam;
  const Eigen::RowVector3d c = surface_R_cam.row(2);
  const double middle = (front ? surface.front : surface.back).cells / 2.0;
  const Eigen::RowVector3d a = (eye.x() * c - eye.z() * surface_R_cam.row(0)) / surface.unit_m + middle * c;
  const Eigen::RowVector3d b = (eye.y() * c - eye.z() * surface_R_cam.row(1)) / surface.unit_m + middle * c;
  return {form(a, view.cam_ray_shift), form(b, view.cam_ray_shift), form(c, view.cam_ray_shift)};
}

SurfaceView view_of(const PreparedSurface& surface, const SE3& map_T_cam) {
  SurfaceView view{.surface = &surface};
  const Eigen::Vector3d eye =
      surface.surface_R_map * (map_T_cam.translation() - surface.map_T_surface.translation());
  view.front = eye.z() < 0;
  const Eigen::Vector2d nearest = eye.head<2>().cwiseMax(-surface.half_m).cwiseMin(surface.half_m);
  view.nearest_m = std::hypot((eye.head<2>() - nearest).norm(), eye.z());
  std::array<Eigen::Vector3d, 4> cam_p;
  const SE3 cam_T_map = map_T_cam.inverse();
  for (std::size_t i = 0; i < 4; ++i) cam_p[i] = cam_T_map * surface.map_p_corners[i];
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d normal = cam_p[i].cross(cam_p[(i + 1) % 4]);
    const Eigen::Vector3d inwards = view.front ? normal : Eigen::Vector3d(-normal);
    view.cam_n_edges[i] = inwards.stableNormalized();
  }
  return view;
}

std::vector<const PreparedSurface*> from_far_to_near(std::span<const PreparedSurface> surfaces,
                                                     const SE3& map_T_cam, double half_view_rad) {
  constexpr double kNearestM = 1e-3;
  const Eigen::Vector3d& eye = map_T_cam.translation();
  const Eigen::Vector3d axis = map_T_cam.rotation() * Eigen::Vector3d::UnitZ();
  std::vector<Placed> placed;
  for (const PreparedSurface& surface : surfaces) {
    const double depth = -surface.surface_R_map.row(2).dot(eye - surface.map_T_surface.translation());
    if (std::abs(depth) < kNearestM || (depth < 0 && !surface.finish.two_sided)) continue;
    const Placed candidate = place(surface, eye, depth > 0);
    const double off_axis = std::acos(std::clamp(axis.dot(candidate.direction), -1.0, 1.0));
    if (candidate.angle_rad < kMaxConeRad && off_axis > half_view_rad + candidate.angle_rad) continue;
    placed.push_back(candidate);
  }
  return sorted(placed);
}

Meeting meets(const SurfaceView& view, const RayTable::Tile& tile, double turn_rad, double move_m) {
  const double parallax = view.nearest_m > move_m ? std::asin(move_m / view.nearest_m) : std::numbers::pi;
  const double margin = tile.angle_rad + turn_rad + parallax + 1e-6;
  if (margin >= std::numbers::pi / 2) return Meeting::Partly;
  const double sine = std::sin(margin);
  bool wholly = true;
  for (const Eigen::Vector3d& edge : view.cam_n_edges) {
    const double inside = edge.dot(tile.cam_ray);
    if (inside < -sine) return Meeting::None;
    wholly = wholly && inside > sine;
  }
  return wholly ? Meeting::Wholly : Meeting::Partly;
}

namespace {

constexpr int kSize = SurfaceTexture::kCells * SurfaceTexture::kTexelsPerCell;

double blend(double t) { return t * t * (3 - 2 * t); }

double lattice(int octave, int count, int i, int j) {
  const int place = (j % count) * 0x4000 + i % count;
  const std::uint64_t key = mix(static_cast<std::uint64_t>(octave)) + static_cast<std::uint64_t>(place);
  return static_cast<double>(mix(key) >> 11U) * 0x1.0p-52 - 1.0;
}

/// Value noise that repeats after `count` cells (Lewis, "Algorithms for solid noise synthesis", SIGGRAPH
/// 1989).
double value_noise(int octave, int count, double x, double y) {
  const int i = static_cast<int>(x);
  const int j = static_cast<int>(y);
  const double u = blend(x - i);
  const double v = blend(y - j);
  const double above = lattice(octave, count, i, j) * (1 - u) + lattice(octave, count, i + 1, j) * u;
  const double below = lattice(octave, count, i, j + 1) * (1 - u) + lattice(octave, count, i + 1, j + 1) * u;
  return above * (1 - v) + below * v;
}

double speckle(double u, double v) {
  double sum = 0;
  double amplitude = 0.4;
  for (int octave = 0; octave < 5; ++octave, amplitude *= 0.75) {
    const int scale = 1 << octave;
    sum += amplitude * value_noise(octave, SurfaceTexture::kCells * scale, u * scale, v * scale);
  }
  return std::clamp(sum, -1.0, 1.0);
}

double tiles(double u, double v) {
  constexpr double kJoint = 0.03;  // as a fraction of a cell
  const double x = u - std::floor(u);
  const double y = v - std::floor(v);
  if (x < kJoint || y < kJoint) return -1;
  return 0.15 * speckle(u, v) +
         0.25 * lattice(9, SurfaceTexture::kCells, static_cast<int>(u), static_cast<int>(v));
}

double checker(double u, double v) {
  return (static_cast<int>(u) + static_cast<int>(v)) % 2 == 0 ? 1.0 : -1.0;
}

double value(int kind, double u, double v) {
  constexpr int kTiles = 1;
  constexpr int kChecker = 2;
  constexpr int kSpeckle = 3;
  if (kind == kTiles) return tiles(u, v);
  if (kind == kChecker) return checker(u, v);
  return kind == kSpeckle ? speckle(u, v) : 0.0;
}

std::vector<float> halved(const std::vector<float>& fine, int size) {
  const auto n = static_cast<std::size_t>(size);
  std::vector<float> coarse(n * n / 4);
  for (std::size_t y = 0; y < n / 2; ++y) {
    for (std::size_t x = 0; x < n / 2; ++x) {
      const float* from = fine.data() + 2 * y * n + 2 * x;
      coarse[y * n / 2 + x] = (from[0] + from[1] + from[n] + from[n + 1]) / 4;
    }
  }
  return coarse;
}

/// Much faster than std::floor on processors that lack an instruction for it.
std::int32_t whole(float x) {
  const auto towards_zero = static_cast<std::int32_t>(x);
  return towards_zero - (x < static_cast<float>(towards_zero) ? 1 : 0);
}

float bilinear(const float* texels, int size, float u, float v) {
  const float x = u - 0.5F;
  const float y = v - 0.5F;
  const std::int32_t i = whole(x);
  const std::int32_t j = whole(y);
  const float dx = x - static_cast<float>(i);
  const float dy = y - static_cast<float>(j);
  const auto mask = static_cast<std::uint32_t>(size - 1);  // size is a power of 2: also wraps negatives
  const auto n = static_cast<std::size_t>(size);
  const auto left = static_cast<std::uint32_t>(i);
  const auto top = static_cast<std::uint32_t>(j);
  const std::size_t x0 = left & mask;
  const std::size_t x1 = (left + 1) & mask;
  const float* above = texels + (top & mask) * n;
  const float* below = texels + ((top + 1) & mask) * n;
  const float a = above[x0] + dx * (above[x1] - above[x0]);
  const float b = below[x0] + dx * (below[x1] - below[x0]);
  return a + dy * (b - a);
}

}  // namespace

SurfaceTexture::SurfaceTexture(int kind) {
  std::vector<float> finest(static_cast<std::size_t>(kSize) * kSize);
  double sum = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double at = value(kind, (x + 0.5) / kTexelsPerCell, (y + 0.5) / kTexelsPerCell);
      finest[static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)] = static_cast<float>(at);
      sum += at;
    }
  }
  const auto mean = static_cast<float>(sum / (static_cast<double>(kSize) * kSize));
  for (float& texel : finest) texel -= mean;
  levels_.push_back(std::move(finest));
  for (int size = kSize; size > 1; size /= 2) levels_.push_back(halved(levels_.back(), size));
}

SurfaceTexture::Level SurfaceTexture::level(double texels) const {
  const double last = static_cast<double>(levels_.size() - 1);
  const double wanted =
      std::isfinite(texels) ? std::clamp(std::log2(std::max(texels, 1.0)), 0.0, last) : last;
  const auto fine = static_cast<std::size_t>(wanted);
  const std::size_t coarse = std::min(fine + 1, levels_.size() - 1);
  return {.fine = this->texels(fine),
          .coarse = this->texels(coarse),
          .fine_size = kSize >> fine,
          .coarse_size = kSize >> coarse,
          .to_coarse = static_cast<float>(wanted - static_cast<double>(fine))};
}

float SurfaceTexture::at(const Level& level, float u, float v) {
  const float fine_scale = static_cast<float>(level.fine_size) / kCells;
  const float coarse_scale = static_cast<float>(level.coarse_size) / kCells;
  const float fine = bilinear(level.fine, level.fine_size, u * fine_scale, v * fine_scale);
  if (level.to_coarse < 0.05F) return fine;
  const float coarse = bilinear(level.coarse, level.coarse_size, u * coarse_scale, v * coarse_scale);
  return fine + level.to_coarse * (coarse - fine);
}

namespace {

template <int kKind>
const SurfaceTexture& texture_of_kind() {
  static const SurfaceTexture kTexture(kKind);
  return kTexture;
}

}  // namespace

const SurfaceTexture& surface_texture(int kind) {
  static_assert(kFloorTextures.size() == 4);
  switch (kind) {
    case 1:
      return texture_of_kind<1>();
    case 2:
      return texture_of_kind<2>();
    case 3:
      return texture_of_kind<3>();
    default:
      return texture_of_kind<0>();
  }
}

namespace {

constexpr float kMaxCoordinateCells = 1e6F;  // limit for texel indices

float value(const PlaneRays::Form& form, float x, float y, float z) {
  return form.shift + form.x * x + form.y * y + form.z * z;
}

/// Intersection of the line of sight through a pixel corner with the plane, in units of cells.
Eigen::Vector2f meet(const PlaneRays& plane, const RayTable& rays, int x, int y, float per_unit) {
  const float rx = rays.rays(0, y)[x];
  const float ry = rays.rays(1, y)[x];
  const float rz = rays.rays(2, y)[x];
  const float scale = per_unit / std::max(value(plane.c, rx, ry, rz), kMinFaceDepth);
  const auto near = [](float cells) {
    return std::max(-kMaxCoordinateCells, std::min(kMaxCoordinateCells, cells));
  };
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
  // The longer side of a node's footprint, evaluated in the middle of the row.
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
      if (ray.z() < static_cast<double>(kMinFaceDepth)) continue;
      const Eigen::Vector3d at = eye - ray * (eye.z() / ray.z());
      const Eigen::Vector3d half = ((lamp - at).normalized() - ray).normalized();
      const double cosine = std::max(0.0, -half.z());
      const double shine = view.surface->finish.gloss * std::pow(cosine, kShininess);
      values[row_major(y, kTilePx, x)] += static_cast<float>(shine);
    }
  }
}

}  // namespace waymark::render
