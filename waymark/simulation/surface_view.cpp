#include "waymark/simulation/surface_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace waymark::render {
namespace {

constexpr double kInPlaneM = 2e-3;  // nearer to a plane counts as in it
constexpr double kWide = 1.2;       // [rad] beyond, a cone about the middle is no bound
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
  const double paper_beyond = 1e-5;  // no sliver where the paper ends with the tag
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

/// What painting in order needs of a surface.
struct Placed {
  const PreparedSurface* surface = nullptr;
  bool front = true;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< from the camera to its middle, unit
  double angle_rad = 0;                                 ///< to its farthest corner from there
  double distance_m = 0;
};

Eigen::Vector3d towards_camera(const Placed& p) {
  const Eigen::Vector3d into = p.surface->surface_R_map.row(2).transpose();
  return p.front ? Eigen::Vector3d(-into) : into;
}

/// Whether p could hide a part of q.
bool may_hide(const Placed& p, const Placed& q) {
  const auto height_over = [](const Placed& plane, const Eigen::Vector3d& point) {
    return towards_camera(plane).dot(point - plane.surface->map_p_corners[0]);
  };
  const auto& of_p = p.surface->map_p_corners;
  const auto& of_q = q.surface->map_p_corners;
  const bool before_q =
      std::any_of(of_p.begin(), of_p.end(), [&](const auto& c) { return height_over(q, c) > kInPlaneM; });
  const bool q_behind =
      std::any_of(of_q.begin(), of_q.end(), [&](const auto& c) { return height_over(p, c) < -kInPlaneM; });
  return before_q && q_behind;
}

bool in_one_plane(const Placed& p, const Placed& q) {
  return std::all_of(p.surface->map_p_corners.begin(), p.surface->map_p_corners.end(), [&](const auto& c) {
    return std::abs(towards_camera(q).dot(c - q.surface->map_p_corners[0])) <= kInPlaneM;
  });
}

/// Whether p (earlier in the scene than q) must be drawn before q, or after it, or neither.
int order_of(const Placed& p, const Placed& q) {
  const bool small = p.angle_rad < kWide && q.angle_rad < kWide;
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

/// Takes, again and again, the first of those that nothing left must be drawn before.
std::vector<const PreparedSurface*> sorted(const std::vector<Placed>& placed) {
  const std::size_t n = placed.size();
  std::vector<std::uint8_t> before(n * n, 0);  // before[i * n + j]: i must be drawn before j
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
    if (next == n) next = farthest;  // a ring
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
    if (candidate.angle_rad < kWide && off_axis > half_view_rad + candidate.angle_rad) continue;
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

}  // namespace waymark::render
