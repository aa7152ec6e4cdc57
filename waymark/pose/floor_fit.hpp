#pragma once

#include <Eigen/Core>

#include "waymark/base/fields.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark {

/// Accuracy of the floor and of how the camera is mounted relative to it.
struct FloorOptions {
  double tilt_sigma_rad = 0.005;
  double height_sigma_m = 0.005;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.tilt_sigma_rad,
          Field{"tilt_sigma_rad", "Standard deviation of the tilt of the robot, and thus of its camera.",
                1e-6, 3});
    visit(self.height_sigma_m,
          Field{"height_sigma_m", "Standard deviation of the height of tags above the floor.", 1e-6, 1e3});
  }
};

/// The planar part of a 3D pose.
struct FloorFit {
  Uncertain<SE2> a_X_b{};
  double chi2 =
      /// residual of the components that planar motion cannot explain (height and two tilts), with 3 degrees
      /// of freedom
      0;
};

/// Finds the X for which lift(X) * shape best explains a measured base_T_tag. A robot on a floor can only
/// turn and move in the plane; `shape` contains the height and tilts of the tag. Minimises the squared
/// Mahalanobis distance of
///
///     log(base_T_tag (lift(X) shape)^-1)
///
/// under the covariance of the measurement plus that of the floor. The floor constrains components that are
/// uncertain in the 3D pose, so the covariance of X is smaller than that of the projected pose. Uses
/// Gauss-Newton iteration; takes a few microseconds.
[[nodiscard]] FloorFit fit_to_floor(const Uncertain<SE3>& base_T_tag, const SE3& shape,
                                    const FloorOptions& options = {});

}  // namespace waymark
