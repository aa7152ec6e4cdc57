#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "waymark/base/random.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/samples/tag_detection.hpp"

/// Views of tags with known poses, for tests and benchmarks.
namespace waymark::testing {

inline constexpr double kTagSize = 0.16;
inline constexpr double kFocal = 600;

/// 640 x 480 without distortion, focal length 600 px.
inline CameraModel plain_camera() {
  return CameraModel::make(PinholeRadtan{kFocal, kFocal, 320, 240, {}, 0}, 640, 480).value();
}
/// The same with the distortion of a cheap lens.
inline CameraModel distorting_camera() {
  return CameraModel::make(PinholeRadtan{kFocal, kFocal + 5, 322, 237, {-0.28, 0.09, 8e-4, -6e-4, -0.012}, 5},
                           640, 480)
      .value();
}
/// A fisheye with a field of view beyond 90 degrees off the axis.
inline CameraModel fisheye_camera() {
  return CameraModel::make(Equidistant{280, 281, 640, 480, {0.02, -0.008, 0.002, -0.0003}}, 1280, 960)
      .value();
}

/// Range of random views.
struct ViewRange {
  double min_size_px = 40, max_size_px = 200;  ///< side of the tag if it faced the camera
  double min_tilt_deg = 0, max_tilt_deg = 70;  ///< angle between the tag's z and the line of sight
  double max_off_axis = 0.25;                  ///< tangent of the direction to the tag
};

/// A random view: the tag's direction, its tilt about any axis perpendicular to the line of sight, and its
/// roll are uniform.
inline SE3 random_view(Random& random, const ViewRange& range = {}, double size_m = kTagSize,
                       double focal_px = kFocal) {
  const double z = focal_px * size_m / random.uniform(range.min_size_px, range.max_size_px);
  const double x = random.uniform(-range.max_off_axis, range.max_off_axis);
  const double y = random.uniform(-range.max_off_axis, range.max_off_axis);
  const Eigen::Vector3d cam_t_tag = z * Eigen::Vector3d(x, y, 1);
  // The smallest rotation of z towards the tag. (Eigen's FromTwoVectors costs every test seven seconds of
  // compilation.)
  const Eigen::Vector3d across = Eigen::Vector3d::UnitZ().cross(cam_t_tag.normalized());
  const double turn = std::atan2(across.norm(), cam_t_tag.normalized().z());
  const SO3 towards = SO3::exp(across.norm() > 0 ? Eigen::Vector3d(turn * across.normalized()) : across);
  const double tilt = random.uniform(range.min_tilt_deg, range.max_tilt_deg) * std::numbers::pi / 180;
  const double about = random.uniform(0, 2 * std::numbers::pi);
  const SO3 tilted = SO3::exp(tilt * Eigen::Vector3d(std::cos(about), std::sin(about), 0));
  const SO3 rolled = SO3::exp({0, 0, random.uniform(-std::numbers::pi, std::numbers::pi)});
  return {towards * tilted * rolled, cam_t_tag};
}

/// The corners TL, TR, BR, BL of a tag in its own frame, independent of the code under test.
inline std::array<Eigen::Vector3d, 4> tag_corners(double size_m = kTagSize) {
  const double h = size_m / 2;
  return {Eigen::Vector3d(-h, -h, 0), Eigen::Vector3d(h, -h, 0), Eigen::Vector3d(h, h, 0),
          Eigen::Vector3d(-h, h, 0)};
}

/// The detection of the tag in this view; nothing if a corner is outside the domain of the camera model.
inline std::optional<TagDetection> see_tag(const CameraModel& camera, const SE3& cam_T_tag,
                                           double size_m = kTagSize, int number = 0) {
  TagDetection seen;
  seen.tag.number = number;
  const auto corners = tag_corners(size_m);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto px = camera.project(cam_T_tag * corners.at(i));
    if (!px) return std::nullopt;
    seen.corners_px.at(i) = *px;
  }
  return seen;
}

/// The same with independent normal noise on every coordinate.
inline TagDetection with_noise(TagDetection seen, double sigma_px, Random& random) {
  for (Eigen::Vector2d& corner : seen.corners_px) {
    for (int k = 0; k < 2; ++k) corner[k] += random.normal(0, sigma_px);
  }
  return seen;
}

/// Some positive definite covariance of four corners.
inline CornerCovariance some_covariance(Random& random) {
  CornerCovariance A;
  for (double& entry : A.reshaped()) entry = 0.05 * random.normal();
  return A * A.transpose() + 0.0025 * CornerCovariance::Identity();
}

}  // namespace waymark::testing
