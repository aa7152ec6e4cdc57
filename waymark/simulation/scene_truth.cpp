#include <cmath>
#include <optional>

#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/scene_exposure.hpp"

namespace waymark::render {
namespace {

constexpr int kPoints = 17;

/// Whether a surface is met on the way from the eye to a point, well before it.
bool is_in_the_way(const PreparedSurface& surface, const Eigen::Vector3d& eye, const Eigen::Vector3d& map_p) {
  constexpr double kNotYet = 2e-3;  // [m] before the point
  const Eigen::Vector3d from = surface.surface_R_map * (eye - surface.map_T_surface.translation());
  const Eigen::Vector3d to = surface.surface_R_map * (map_p - surface.map_T_surface.translation());
  if (from.z() > 0 && !surface.finish.two_sided) return false;
  if (from.z() * to.z() >= 0 || std::abs(to.z()) < kNotYet) return false;
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

  /// Where a point of the tag's plane appears, in the middle of the exposure of its row.
  [[nodiscard]] std::optional<Eigen::Vector2d> pixel(const Eigen::Vector3d& map_p) const {
    auto px = parts_.model.project(exposure_.map_T_cam.inverse() * map_p);
    constexpr int kSteps = 4;  // each is closer by the share of readout the picture moves in
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
      if (is_in_the_way(*surface, eye, map_p)) return false;
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
  if (truth.cam_T_tag.inverse().translation().z() >= 0) return std::nullopt;  // from behind
  const TagObserver observer(exposure, motion, surface.map_T_surface, surface.tag_size_m);
  const auto corners = tag_corners(surface.tag_size_m);
  bool near_picture = false;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3d map_p = surface.map_T_surface * corners[i];
    const auto px = observer.pixel(map_p);
    if (!px) return std::nullopt;
    truth.corners_px[i] = *px;
    truth.corner_visible[i] = observer.is_visible(map_p, px);
    near_picture = near_picture || exposure.parts->model.contains(*px);
  }
  const auto centre = exposure.parts->model.project(truth.cam_T_tag.translation());
  if (!near_picture && !(centre && exposure.parts->model.contains(*centre))) return std::nullopt;
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

}  // namespace waymark::render
