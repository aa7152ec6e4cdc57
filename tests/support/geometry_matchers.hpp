#pragma once

#include <cmath>
#include <ostream>

#include <gmock/gmock.h>
#include <Eigen/Core>

#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"

// Matchers that report differences in metres and radians:
//
//     EXPECT_THAT(map_T_base, SE3Near(truth, 0.01, 0.02));
//
// A non-finite value matches nothing.
namespace waymark::testing {

namespace internal {

/// Distance of two motions: of the origins [m], and the angle of the rotation between them [rad].
struct PoseDistance {
  double translation = 0.0;
  double rotation = 0.0;
};

[[nodiscard]] inline PoseDistance distance(const SE3& X, const SE3& Y) {
  return {(X.translation() - Y.translation()).norm(), (X.rotation().inverse() * Y.rotation()).angle()};
}
[[nodiscard]] inline PoseDistance distance(const SE2& X, const SE2& Y) {
  return {(X.translation() - Y.translation()).norm(),
          std::abs((X.rotation().inverse() * Y.rotation()).angle())};
}

[[nodiscard]] inline bool within(const PoseDistance& d, double translation_tolerance,
                                 double rotation_tolerance, std::ostream* why) {
  if (why != nullptr) *why << "which is " << d.translation << " m and " << d.rotation << " rad away";
  return d.translation <= translation_tolerance && d.rotation <= rotation_tolerance;  // false for NaN
}

}  // namespace internal

/// A matrix or vector whose every entry is within `tolerance` of `expected`.
MATCHER_P2(MatrixNear, expected, tolerance, "differs by at most " + ::testing::PrintToString(tolerance)) {
  if (arg.rows() != expected.rows() || arg.cols() != expected.cols()) {
    *result_listener << "which is " << arg.rows() << " x " << arg.cols();
    return false;
  }
  bool near = true;
  double worst = 0.0;
  for (Eigen::Index i = 0; i < arg.rows(); ++i) {
    for (Eigen::Index j = 0; j < arg.cols(); ++j) {
      const double error = std::abs(arg(i, j) - expected(i, j));
      near = near && error <= tolerance;  // false for NaN
      if (!(error <= worst)) worst = error;
    }
  }
  *result_listener << "whose largest difference is " << worst;
  return near;
}

/// An SO3 within `tolerance` [rad] of `expected`.
MATCHER_P2(SO3Near, expected, tolerance, "is within " + ::testing::PrintToString(tolerance) + " rad") {
  const double angle = (expected.inverse() * arg).angle();
  *result_listener << "which is " << angle << " rad away";
  return angle <= tolerance;
}

/// An SE3 whose origin is within `translation_m` and whose rotation is within `rotation_rad` of `expected`.
MATCHER_P3(SE3Near, expected, translation_m, rotation_rad,
           "is within " + ::testing::PrintToString(translation_m) + " m and " +
               ::testing::PrintToString(rotation_rad) + " rad") {
  return internal::within(internal::distance(SE3(expected), SE3(arg)), translation_m, rotation_rad,
                          result_listener->stream());
}

/// An SE2 whose origin is within `translation_m` and whose heading is within `rotation_rad` of `expected`.
MATCHER_P3(SE2Near, expected, translation_m, rotation_rad,
           "is within " + ::testing::PrintToString(translation_m) + " m and " +
               ::testing::PrintToString(rotation_rad) + " rad") {
  return internal::within(internal::distance(SE2(expected), SE2(arg)), translation_m, rotation_rad,
                          result_listener->stream());
}

/// Any group element whose matrix is within `tolerance` of that of `expected`, entry by entry.
MATCHER_P2(GroupNear, expected, tolerance,
           "has a matrix that differs by at most " + ::testing::PrintToString(tolerance)) {
  return ::testing::ExplainMatchResult(MatrixNear(expected.matrix(), tolerance), arg.matrix(),
                                       result_listener);
}

}  // namespace waymark::testing
