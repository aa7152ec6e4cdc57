#pragma once

#include <cmath>

#include <rapidcheck.h>

#include "waymark/camera/camera_model.hpp"

/// Cameras for property tests only. Failing cases shrink towards no distortion.
namespace waymark::testing {

/// Uniform in [0, count), at every size.
inline int index_below(int count) { return *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, count)); }
/// Uniform in [-1, 1], shrinking to 0.
inline double fraction() {
  const double magnitude = index_below(1'000'001) * 1e-6;
  return index_below(2) == 0 ? magnitude : -magnitude;
}
/// Uniform in [low, high], shrinking to the middle.
inline double between(double low, double high) {
  return 0.5 * (low + high) + 0.5 * (high - low) * fraction();
}
/// Uniform in (0, 1) in three of four cases, otherwise 1 - 10^-n: just inside the limit.
inline double near_one() {
  if (index_below(4) == 0) return 1.0 - std::pow(10.0, -1 - index_below(13));
  return between(1e-6, 1.0 - 1e-6);
}

inline PinholeRadtan any_radtan() {
  PinholeRadtan camera{.fx = between(200, 1500), .fy = 0, .cx = between(220, 420), .cy = between(140, 340)};
  camera.fy = camera.fx * between(0.9, 1.1);
  camera.coefficients = *rc::gen::element(0, 4, 5, 8);
  const std::array<double, 8> spread = {0.5, 0.3, 0.01, 0.01, 0.1, 0.3, 0.2, 0.1};
  for (std::size_t i = 0; i < static_cast<std::size_t>(camera.coefficients); ++i) {
    camera.k.at(i) = spread.at(i) * fraction();
  }
  return camera;
}

inline Equidistant any_equidistant() {
  Equidistant camera{.fx = between(150, 600), .fy = 0, .cx = between(220, 420), .cy = between(140, 340)};
  camera.fy = camera.fx * between(0.9, 1.1);
  const std::array<double, 4> spread = {0.1, 0.05, 0.02, 0.005};
  for (std::size_t i = 0; i < 4; ++i) camera.k.at(i) = spread.at(i) * fraction();
  return camera;
}

/// A camera of 640 x 480 that make() accepts; draws that fold inside the image are rejected.
inline CameraModel any_camera() {
  const bool fisheye = index_below(3) == 2;
  const auto camera =
      fisheye ? CameraModel::make(any_equidistant(), 640, 480) : CameraModel::make(any_radtan(), 640, 480);
  RC_PRE(camera.has_value());
  return *camera;
}

/// A direction at this angle from the optical axis [rad], uniform about it.
inline Eigen::Vector3d direction(double angle_rad) {
  const double around = 3.14159265358979 * fraction();
  return {std::sin(angle_rad) * std::cos(around), std::sin(angle_rad) * std::sin(around),
          std::cos(angle_rad)};
}

}  // namespace waymark::testing
