#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "waymark/simulation/pixel_area.hpp"
#include "waymark/simulation/ray_table.hpp"
#include "waymark/simulation/scene.hpp"

namespace waymark::render {

/// A surface made ready for pictures.
struct PreparedSurface {
  SE3 map_T_surface{};
  Eigen::Matrix3d surface_R_map = Eigen::Matrix3d::Identity();
  std::array<Eigen::Vector3d, 4> map_p_corners{};  ///< TL TR BR BL
  Eigen::Vector2d half_m = Eigen::Vector2d::Zero();
  PatternGrid front{};
  PatternGrid back{};  ///< blank
  double unit_m = 1;   ///< a unit of the grids
  Finish finish{};
  double gain_front = 1, gain_back = 1;  ///< how much light falls on either side
};

[[nodiscard]] PreparedSurface prepare(const SceneSurface& surface, const Scene& scene, double ambient);

/// Where a camera stands for a moment: one sample of the exposure, through one point of its lens.
struct Viewpoint {
  Eigen::Matrix3d map_R_cam = Eigen::Matrix3d::Identity();
  Eigen::Vector3d map_t_lens = Eigen::Vector3d::Zero();  ///< the point of the lens
  /// What a point of the lens off its centre adds to every ray: minus its offset over the focus distance.
  Eigen::Vector3d cam_ray_shift = Eigen::Vector3d::Zero();
};

/// A surface from a viewpoint: a ray r meets its plane at (a / c, b / c) in units of its grid, each of them
/// x r.x + y r.y + z r.z + shift.
struct PlaneRays {
  struct Form {
    float x = 0, y = 0, z = 0, shift = 0;
  };
  Form a{}, b{}, c{};
};

[[nodiscard]] PlaneRays plane_rays(const PreparedSurface& surface, bool front, const Viewpoint& view);

/// A surface from where the camera is in the middle of the exposure.
struct SurfaceView {
  const PreparedSurface* surface = nullptr;
  bool front = true;
  double nearest_m = 0;  ///< to any of its points
  std::array<Eigen::Vector3d, 4>
      cam_n_edges{};  ///< unit; a ray that is on the inner side of all four meets it

  [[nodiscard]] const PatternGrid& grid() const { return front ? surface->front : surface->back; }
};

[[nodiscard]] SurfaceView view_of(const PreparedSurface& surface, const SE3& map_T_cam);

/// The surfaces that a camera may see, the farthest first: each is drawn over those before it. Pairwise tests
/// of planes (Newell, Newell and Sancha, "A solution to the hidden surface problem", ACM 1972); surfaces that
/// pierce each other, or cover each other in a ring, are not resolved. Those within `reach_m` of their own
/// plane are left out. O(surfaces squared).
[[nodiscard]] std::vector<const PreparedSurface*> from_far_to_near(std::span<const PreparedSurface> surfaces,
                                                                   const SE3& map_T_cam,
                                                                   double half_view_rad);

enum class Meeting : std::uint8_t { None, Partly, Wholly };

/// Whether a surface fills a tile, misses it, or neither is sure, while the camera turns by up to `turn_rad`
/// and moves by up to `move_m` from where the view was taken.
[[nodiscard]] Meeting meets(const SurfaceView& view, const RayTable::Tile& tile, double turn_rad,
                            double move_m);

}  // namespace waymark::render
