#include "waymark/simulation/render/scene_camera.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "waymark/simulation/render/scene_exposure.hpp"

namespace waymark {
namespace {

constexpr std::int64_t kMaxImagePixels = 100'000'000;
// with more than 32 px of blur no tag is readable, so visible stripes do not matter
constexpr double kMaxMoments = 64;
constexpr double kMaxLensPoints = 256;  // beyond 10 px, discs show individual points

double exposure_s(const SceneCameraOptions& options) { return options.exposure_ms * 1e-3; }

/// Largest motion and defocus of surface outlines in the image during the exposure.
struct OutlineMotion {
  double way_px = 0;   ///< longest path of any point
  double disc_px = 0;  ///< largest defocus blur of any point
};

/// Takes into account the path of a point from the beginning through the middle to the end of the exposure,
/// if the point is in the image.
void follow(const SceneCamera::Parts& parts, const std::array<SE3, 3>& cam_T_map,
            const Eigen::Vector3d& map_p, OutlineMotion& most) {
  constexpr double kNearestM = 0.02;
  const Eigen::Vector3d cam_p = cam_T_map[1] * map_p;
  const auto middle = parts.model.project(cam_p);
  if (!middle || !parts.model.contains(*middle)) return;
  double way = 0;
  for (const std::size_t end : {0U, 2U}) {
    if (const auto px = parts.model.project(cam_T_map[end] * map_p)) way += (*px - *middle).norm();
  }
  const double defocus = 1 / std::max(kNearestM, cam_p.norm()) - 1 / parts.options.focus_distance_m;
  const double disc = std::abs(defocus) * parts.options.aperture_mm * 1e-3 * parts.rays->px_per_rad();
  most.way_px = std::max(most.way_px, way);
  most.disc_px = std::max(most.disc_px, disc);
}

OutlineMotion outline_motion(const SceneCamera::Parts& parts, const std::array<SE3, 3>& cam_T_map) {
  constexpr int kPointsOfSide = 16;  // a large surface may have no corner inside the image
  OutlineMotion most;
  for (std::size_t i = 0; i < parts.surfaces.size(); ++i) {
    const auto& corners = parts.surfaces[i].map_p_corners;
    const int points = parts.scene.surfaces[i].tag ? 1 : kPointsOfSide;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Eigen::Vector3d along = (corners[(k + 1) % 4] - corners[k]) / points;
      for (int j = 0; j < points; ++j) follow(parts, cam_T_map, corners[k] + j * along, most);
    }
  }
  return most;
}

/// Number of time samples needed for motion blur, or of lens points for defocus.
int samples_needed(const SceneCamera::Parts& parts, const CameraMotion& motion, const SE3& middle) {
  constexpr double kPointsPerPx = 3;
  const double half = exposure_s(parts.options) / 2;
  const std::array<SE3, 3> map_T_cam = {motion(-half), middle, motion(half)};
  const OutlineMotion most =
      outline_motion(parts, {map_T_cam[0].inverse(), middle.inverse(), map_T_cam[2].inverse()});
  const double turn = (map_T_cam[0].rotation().inverse() * middle.rotation()).angle() +
                      (middle.rotation().inverse() * map_T_cam[2].rotation()).angle();
  const double way = std::max(most.way_px, turn * parts.rays->px_per_rad());
  const double points =
      most.disc_px > 0 ? 1 + kPointsPerPx * std::numbers::pi / 4 * most.disc_px * most.disc_px : 1;
  const double moments = std::clamp(std::ceil(way / parts.options.blur_step_px), 1.0, kMaxMoments);
  return static_cast<int>(std::max(moments, std::clamp(std::ceil(points), 1.0, kMaxLensPoints)));
}

/// Times evenly distributed over the exposure, with the same mean and variance as the exposure. Without the
/// scale factor, the variance of n times would be too small by 1 / n^2.
std::vector<double> sample_times(int count, double exposure) {
  std::vector<double> times;
  const double n = count;
  const double wider = count > 1 ? n / std::sqrt(n * n - 1) : 1;
  times.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) times.push_back(((i + 0.5) / n - 0.5) * wider * exposure);
  return times;
}

tl::unexpected<Error> fail_motion() {
  return fail(ErrorCode::InvalidArgument, "non-finite camera motion", {.key = "motion"});
}

/// Points evenly distributed over the lens (Vogel, "A better way to construct the sunflower head",
/// Mathematical Biosciences 1979), in an order that is independent of time. Their mean and variance are those
/// of the disc.
std::vector<Eigen::Vector3d> lens_points(int count, double aperture_m) {
  std::vector<Eigen::Vector3d> points;
  int stride = std::max(1, static_cast<int>(std::lround(0.618 * count)));
  while (std::gcd(stride, count) != 1) ++stride;
  if (count == 1 || aperture_m == 0)
    return std::vector<Eigen::Vector3d>(static_cast<std::size_t>(count), Eigen::Vector3d::Zero());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (std::int64_t i = 0; i < count; ++i) {
    const auto k = static_cast<double>(i * stride % count);
    const double radius = std::sqrt((k + 0.5) / count);
    const double angle = k * std::numbers::pi * (3 - std::sqrt(5.0));
    points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0);
    middle += points.back() / count;
  }
  double squares = 0;
  for (Eigen::Vector3d& point : points) squares += (point -= middle).squaredNorm() / count;
  for (Eigen::Vector3d& point : points) point *= aperture_m / 2 * std::sqrt(0.5 / squares);
  return points;
}

Status prepare_scene(SceneCamera::Parts& parts) {
  if (Status good = check(parts.scene); !good) return good;
  parts.surfaces.clear();
  for (const SceneSurface& surface : parts.scene.surfaces)
    parts.surfaces.push_back(render::prepare(surface, parts.scene, parts.options.ambient));
  return {};
}

/// Half the opening angle of the viewing cone.
double half_view_rad(const render::RayTable& rays) {
  double widest = 0;
  for (int row = 0; row < rays.tile_rows(); ++row) {
    for (int column = 0; column < rays.tile_columns(); ++column) {
      const render::RayTable::Tile& tile = rays.tile(column, row);
      if (tile.sees)
        widest = std::max(widest, std::acos(std::clamp(tile.cam_ray.z(), -1.0, 1.0)) + tile.angle_rad);
    }
  }
  return widest;
}

}  // namespace

Result<SceneCamera> SceneCamera::make(Scene scene, const CameraModel& model,
                                      const SceneCameraOptions& options) {
  if (Status ranges = check_ranges(options); !ranges) return tl::unexpected(ranges.error());
  if (std::int64_t{model.width_px()} * model.height_px() > kMaxImagePixels) {
    return fail(ErrorCode::LimitExceeded, fmt::format("image of {} x {} px, more than {} pixels",
                                                      model.width_px(), model.height_px(), kMaxImagePixels));
  }
  auto parts = std::make_shared<Parts>(Parts{.scene = std::move(scene), .model = model, .options = options});
  if (Status good = prepare_scene(*parts); !good) return tl::unexpected(good.error());
  parts->rays = std::make_shared<render::RayTable>(model);
  render::prepare_sensor(*parts);
  return SceneCamera(std::move(parts));
}

Status SceneCamera::set_scene(Scene scene) {
  auto parts = std::make_shared<Parts>(*parts_);
  parts->scene = std::move(scene);
  if (Status good = prepare_scene(*parts); !good) return good;
  parts_ = std::move(parts);
  return {};
}

Result<std::shared_ptr<SceneExposure>> SceneCamera::begin(const CameraMotion& motion, SensorTime stamp,
                                                          std::uint64_t seed) const {
  const SceneCameraOptions& options = parts_->options;
  auto exposure = std::make_shared<SceneExposure>();
  exposure->stamp = stamp;
  exposure->seed = seed;
  exposure->parts = parts_;
  exposure->map_T_cam = motion(0);
  exposure->rolling = options.readout_ms > 0;
  const double reach = (options.exposure_ms + options.readout_ms) * 0.5e-3;
  for (const double time : {-reach, 0.0, reach}) {
    if (!motion(time).matrix().allFinite()) return fail_motion();
  }
  exposure->samples = samples_needed(*parts_, motion, exposure->map_T_cam);
  const std::vector<double> times = sample_times(exposure->samples, exposure_s(options));
  const int rows = exposure->rolling ? parts_->rays->height_px() : 1;
  for (int row = 0; row < rows; ++row) {
    const double middle = exposure->rolling ? render::row_time_s(*parts_, row + 0.5) : 0;
    for (const double time : times) {
      exposure->map_T_cams.push_back(motion(middle + time));
      if (!exposure->map_T_cams.back().matrix().allFinite()) return fail_motion();
    }
  }
  exposure->cam_t_lens = lens_points(exposure->samples, options.aperture_mm * 1e-3);
  exposure->order =
      render::from_far_to_near(parts_->surfaces, exposure->map_T_cam, half_view_rad(*parts_->rays));
  exposure->tags = render::truth_of(*exposure, motion);
  exposure->radiance.resize(parts_->vignetting.size());
  exposure->image = Image(parts_->model.width_px(), parts_->model.height_px());
  return exposure;
}

int SceneCamera::bands() const { return parts_->rays->tile_rows(); }

void SceneCamera::expose(SceneExposure& exposure, int band) const { render::expose_band(exposure, band); }

void SceneCamera::read_out(SceneExposure& exposure, int band) const { render::read_out_band(exposure, band); }

RenderedFrame SceneCamera::finish(SceneExposure& exposure) const {
  return {.stamp = exposure.stamp,
          .image = std::move(exposure.image),
          .map_T_cam = exposure.map_T_cam,
          .tags = std::move(exposure.tags)};
}

Result<RenderedFrame> SceneCamera::render(const CameraMotion& motion, SensorTime stamp,
                                          std::uint64_t seed) const {
  const auto exposure = begin(motion, stamp, seed);
  if (!exposure) return tl::unexpected(exposure.error());
  for (int band = 0; band < bands(); ++band) expose(**exposure, band);
  for (int band = 0; band < bands(); ++band) read_out(**exposure, band);
  return finish(**exposure);
}

const CameraModel& SceneCamera::model() const { return parts_->model; }
const SceneCameraOptions& SceneCamera::options() const { return parts_->options; }

}  // namespace waymark
