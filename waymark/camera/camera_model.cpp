#include "waymark/camera/camera_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <type_traits>

#include <fmt/format.h>

#include "waymark/camera/distortion.hpp"

namespace waymark {
namespace {

// No real lens reaches these limits, and within them no intermediate result overflows.
constexpr double kSmallestFocal = 1e-3;
constexpr double kLargestFocal = 1e7;
constexpr double kLargestCoefficient = 1e6;
constexpr int kLargestSide = 1'000'000;
/// If a point is closer to the camera centre than this, its direction is undefined [m].
constexpr double kNearest = 1e-12;
/// If a point is closer to the optical axis than this, it counts as on the axis [m], because the quotients
/// below would lose precision to denormal numbers.
constexpr double kOnAxis = 1e-200;

auto invalid(std::string message, std::string key, std::string hint) {
  return fail(ErrorCode::InvalidArgument, std::move(message), {.key = std::move(key)}, std::move(hint));
}

Status check_size(int width_px, int height_px) {
  if (width_px > 0 && height_px > 0 && width_px <= kLargestSide && height_px <= kLargestSide) return {};
  return invalid(fmt::format("invalid image size {}x{}", width_px, height_px), "resolution",
                 fmt::format("Give the size of the images in pixels, from 1 to {}.", kLargestSide));
}

Status check_focal(std::string key, double focal) {
  if (focal >= kSmallestFocal && focal <= kLargestFocal) return {};
  return invalid(fmt::format("invalid focal length {}", focal), std::move(key),
                 fmt::format("Give it in pixels, from {} to {:.0f}.", kSmallestFocal, kLargestFocal));
}

Status check_centre(std::string key, double centre) {
  if (std::abs(centre) <= kLargestFocal) return {};
  return invalid(fmt::format("invalid principal point {}", centre), std::move(key),
                 "Give it in pixels; it is usually near the middle of the image.");
}

/// No real sensor has a larger skew. Numbers in a different order, such as column by column, often do.
Status check_skew(double skew, double fx) {
  constexpr double kLargestSkew = 0.1;  // relative to the focal length
  if (std::abs(skew) <= kLargestSkew * fx) return {};
  return invalid(fmt::format("invalid skew {}", skew), "skew",
                 "It is usually 0. Check the order of the numbers in the camera matrix.");
}

template <class Coefficients>
Status check_coefficients(const Coefficients& k) {
  for (const double c : k) {
    if (!(std::abs(c) <= kLargestCoefficient)) {
      return invalid(fmt::format("invalid distortion coefficient {}", c), "distortion",
                     fmt::format("Give a number not larger than {:.0f}.", kLargestCoefficient));
    }
  }
  return {};
}

Status check_count(const PinholeRadtan& camera) {
  const int n = camera.coefficients;
  if (n != 0 && n != 4 && n != 5 && n != 8) {
    return invalid(fmt::format("radial-tangential distortion does not have {} coefficients", n), "distortion",
                   "Give none, 4 (k1 k2 p1 p2), 5 (and k3) or 8 (and k4 k5 k6).");
  }
  const bool rest_is_zero =
      std::all_of(camera.k.begin() + n, camera.k.end(), [](double c) { return c == 0.0; });
  if (rest_is_zero) return {};
  return invalid(fmt::format("a distortion coefficient beyond the {} in use is not zero", n), "distortion",
                 "Set `coefficients` to the number of coefficients given.");
}

Status check_count(const Equidistant&) { return {}; }

template <class Model>
Status check_numbers(const Model& camera) {
  Status status = check_focal("fx", camera.fx);
  if (status) status = check_focal("fy", camera.fy);
  if (status) status = check_centre("cx", camera.cx);
  if (status) status = check_centre("cy", camera.cy);
  if (status) status = check_skew(camera.skew, camera.fx);
  if (status) status = check_coefficients(camera.k);
  if (status) status = check_count(camera);
  return status;
}

/// Distance from the principal point to the nearest edge of the image (or to the image itself, if the point
/// is outside it), in normalised coordinates.
template <class Model>
double nearest_edge(const Model& camera, int width_px, int height_px) {
  const double left = camera.cx / camera.fx;
  const double right = (width_px - camera.cx) / camera.fx;
  const double top = camera.cy / camera.fy;
  const double bottom = (height_px - camera.cy) / camera.fy;
  const double inside = std::min({left, right, top, bottom});
  if (inside >= 0.0) return inside;
  return std::hypot(std::max({0.0, -left, -right}), std::max({0.0, -top, -bottom}));
}

/// Share of the image that is closer to the principal point than `rim`, in normalised coordinates.
template <class Model>
double share_within(const Model& camera, double rim, int width_px, int height_px) {
  constexpr int kSamples = 200;  // per axis
  int inside = 0;
  for (int i = 0; i < kSamples; ++i) {
    for (int j = 0; j < kSamples; ++j) {
      const double y = ((i + 0.5) * height_px / kSamples - camera.cy) / camera.fy;
      const double x = ((j + 0.5) * width_px / kSamples - camera.cx - camera.skew * y) / camera.fx;
      inside += x * x + y * y < rim * rim ? 1 : 0;
    }
  }
  return static_cast<double>(inside) / (kSamples * kSamples);
}

/// A domain that ends before the nearest image edge must cover at least this share of the image. If it covers
/// less, the coefficients have probably been misread or badly fitted.
constexpr double kMinDomainShare = 0.3;

auto folds(double angle_rad, double rim_px, double share) {
  return invalid(
      fmt::format("the distortion folds or tears the image {:.1f} degrees off the axis, {:.0f} px from the "
                  "principal point: its domain covers only {:.0f} % of the image",
                  angle_rad * 180.0 / std::numbers::pi, rim_px, 100 * share),
      "distortion",
      "Calibrate again with views that reach the edges, or check the signs, the order and the number of "
      "the coefficients and the size of the image.");
}

/// The edge of the image circle: where the domain ends, as a distance from the principal point in normalised
/// coordinates. It is infinite if it cannot lie inside an image.
double rim_of(const PinholeRadtan& camera, double limit) {
  if (limit >= Radtan::kLargestRadius) return std::numeric_limits<double>::infinity();
  return Radtan{camera.k}.distorted_radius(limit);
}

/// A circular fisheye has its image circle inside the image, so a domain of at least 90 degrees is enough.
double rim_of(const Equidistant& camera, double limit) {
  if (limit >= 0.5 * std::numbers::pi) return std::numeric_limits<double>::infinity();
  return EquidistantAngle{camera.k}.distort(limit);
}

double domain_of(const PinholeRadtan& camera) { return Radtan{camera.k}.domain(); }
double domain_of(const Equidistant& camera) { return EquidistantAngle{camera.k}.domain(); }

template <class Model>
Result<double> find_domain(const Model& camera, int width_px, int height_px) {
  const double limit = domain_of(camera);
  const double rim = rim_of(camera, limit);
  if (rim >= nearest_edge(camera, width_px, height_px)) return limit;
  const double share = share_within(camera, rim, width_px, height_px);
  if (share >= kMinDomainShare) return limit;
  constexpr bool kIsPinhole = std::is_same_v<Model, PinholeRadtan>;
  return folds(kIsPinhole ? std::atan(limit) : limit, rim * std::min(camera.fx, camera.fy), share);
}

std::optional<Eigen::Vector2d> project_with(const PinholeRadtan& camera, double limit,
                                            const Eigen::Vector3d& cam_p, Matrix23* J_px_p) {
  if (!(cam_p.z() > kNearest) || !std::isfinite(cam_p.z())) return std::nullopt;
  const Eigen::Vector2d undistorted = cam_p.head<2>() / cam_p.z();
  if (!(undistorted.norm() < limit)) return std::nullopt;
  Eigen::Matrix2d J;
  const Eigen::Vector2d distorted = Radtan{camera.k}.distort(undistorted, J_px_p == nullptr ? nullptr : &J);
  if (J_px_p != nullptr) {
    if (camera.skew != 0.0) J.row(0) += camera.skew / camera.fx * J.row(1);
    J.row(0) *= camera.fx / cam_p.z();
    J.row(1) *= camera.fy / cam_p.z();
    *J_px_p << J, -J * undistorted;
  }
  return Eigen::Vector2d(camera.fx * distorted.x() + camera.skew * distorted.y() + camera.cx,
                         camera.fy * distorted.y() + camera.cy);
}

/// Like std::hypot, which is slow; here the arguments cannot overflow.
double length(double x, double y) {
  const double square = x * x + y * y;
  return square > 1e-200 && square < 1e200 ? std::sqrt(square) : std::hypot(x, y);
}

std::optional<Eigen::Vector2d> project_with(const Equidistant& camera, double limit,
                                            const Eigen::Vector3d& cam_p, Matrix23* J_px_p) {
  const double rho = length(cam_p.x(), cam_p.y());
  const double norm = length(rho, cam_p.z());
  if (!(norm > kNearest) || !std::isfinite(norm)) return std::nullopt;
  const double theta = std::atan2(rho, cam_p.z());
  if (!(theta < limit)) return std::nullopt;
  double slope = 0.0;
  const double theta_d = EquidistantAngle{camera.k}.distort(theta, &slope);
  // On the axis, any direction is valid: theta_d / rho equals its radial derivative there.
  const bool on_axis = rho < kOnAxis;
  const double x = on_axis ? 1.0 : cam_p.x() / rho;
  const double y = on_axis ? 0.0 : cam_p.y() / rho;
  if (J_px_p != nullptr) {
    const double across = on_axis ? 1.0 / norm : theta_d / rho;
    const double along = slope * (cam_p.z() / norm) / norm;
    const double depth = -slope * (rho / norm) / norm;
    *J_px_p << camera.fx * (across * y * y + along * x * x), camera.fx * (along - across) * x * y,
        camera.fx * depth * x, camera.fy * (along - across) * x * y,
        camera.fy * (across * x * x + along * y * y), camera.fy * depth * y;
    if (camera.skew != 0.0) J_px_p->row(0) += camera.skew / camera.fy * J_px_p->row(1);
  }
  return Eigen::Vector2d(camera.fx * theta_d * x + camera.skew * theta_d * y + camera.cx,
                         camera.fy * theta_d * y + camera.cy);
}

template <class Model>
Eigen::Vector2d without_intrinsics(const Model& camera, const Eigen::Vector2d& px) {
  const double y = (px.y() - camera.cy) / camera.fy;
  return {(px.x() - camera.cx - camera.skew * y) / camera.fx, y};
}

std::optional<Eigen::Vector3d> unproject_with(const PinholeRadtan& camera, double limit,
                                              const Eigen::Vector2d& px) {
  const auto undistorted = Radtan{camera.k}.undistort(without_intrinsics(camera, px), limit);
  if (!undistorted) return std::nullopt;
  return Eigen::Vector3d(undistorted->x(), undistorted->y(), 1.0).normalized();
}

std::optional<Eigen::Vector3d> unproject_with(const Equidistant& camera, double limit,
                                              const Eigen::Vector2d& px) {
  const Eigen::Vector2d distorted = without_intrinsics(camera, px);
  const double theta_d = std::hypot(distorted.x(), distorted.y());
  const auto theta = EquidistantAngle{camera.k}.undistort(theta_d, limit);
  if (!theta) return std::nullopt;
  const double scale = theta_d > 0.0 ? std::sin(*theta) / theta_d : 1.0;
  return Eigen::Vector3d(scale * distorted.x(), scale * distorted.y(), std::cos(*theta));
}

std::optional<Eigen::Vector2d> normalize_with(const PinholeRadtan& camera, double limit,
                                              const Eigen::Vector2d& px) {
  return Radtan{camera.k}.undistort(without_intrinsics(camera, px), limit);
}

std::optional<Eigen::Vector2d> normalize_with(const Equidistant& camera, double limit,
                                              const Eigen::Vector2d& px) {
  const auto bearing = unproject_with(camera, limit, px);
  if (!bearing || bearing->z() <= 0.0) return std::nullopt;
  return bearing->head<2>() / bearing->z();
}

}  // namespace

Result<CameraModel> CameraModel::make(const Projection& projection, int width_px, int height_px) {
  Status status = check_size(width_px, height_px);
  if (status) status = std::visit([](const auto& camera) { return check_numbers(camera); }, projection);
  if (!status) return tl::unexpected<Error>(status.error());
  const Result<double> limit =
      std::visit([&](const auto& camera) { return find_domain(camera, width_px, height_px); }, projection);
  if (!limit) return tl::unexpected<Error>(limit.error());
  return CameraModel(projection, width_px, height_px, *limit);
}

bool CameraModel::reaches_an_edge() const {
  return std::visit(
      [&](const auto& camera) {
        return rim_of(camera, limit_) >= nearest_edge(camera, width_px_, height_px_);
      },
      projection_);
}

double CameraModel::max_angle_rad() const {
  return std::holds_alternative<PinholeRadtan>(projection_) ? std::atan(limit_) : limit_;
}

std::optional<Eigen::Vector2d> CameraModel::project(const Eigen::Vector3d& cam_p, Matrix23* J_px_p) const {
  const auto px = std::visit([&](const auto& camera) { return project_with(camera, limit_, cam_p, J_px_p); },
                             projection_);
  return px && px->allFinite() ? px : std::nullopt;
}

std::optional<Eigen::Vector3d> CameraModel::unproject(const Eigen::Vector2d& px) const {
  return std::visit([&](const auto& camera) { return unproject_with(camera, limit_, px); }, projection_);
}

std::optional<Eigen::Vector2d> CameraModel::normalize(const Eigen::Vector2d& px) const {
  return std::visit([&](const auto& camera) { return normalize_with(camera, limit_, px); }, projection_);
}

bool CameraModel::contains(const Eigen::Vector2d& px) const {
  return px.x() >= 0.0 && px.y() >= 0.0 && px.x() < width_px_ && px.y() < height_px_;
}

Status check_camera_matches_image(const CameraModel& camera, int width_px, int height_px) {
  if (width_px == camera.width_px() && height_px == camera.height_px()) return {};
  return fail(ErrorCode::InvalidArgument,
              fmt::format("the calibration is for {}x{} but the image is {}x{}", camera.width_px(),
                          camera.height_px(), width_px, height_px),
              {},
              "Calibrate at the resolution in use, or set the camera to the resolution of its calibration.");
}

Result<CameraModel> scaled_camera(const CameraModel& camera, int width_px, int height_px) {
  const double x = static_cast<double>(width_px) / camera.width_px();
  const double y = static_cast<double>(height_px) / camera.height_px();
  constexpr double kMaxApart = 0.01;  // the ratios of 1280x720 and 854x480 differ by 0.0008
  if (width_px > 0 && height_px > 0 && std::abs(x / y - 1) > kMaxApart)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("a calibration for {}x{} does not scale to {}x{}: the aspect ratios differ, so "
                            "one of the images is a crop of the other",
                            camera.width_px(), camera.height_px(), width_px, height_px),
                {}, "Calibrate at the resolution in use.");
  CameraModel::Projection projection = camera.projection();
  std::visit(
      [&](auto& lens) {
        lens.fx *= x;
        lens.skew *= x;
        lens.cx *= x;
        lens.fy *= y;
        lens.cy *= y;
      },
      projection);
  return CameraModel::make(projection, width_px, height_px);
}

}  // namespace waymark
