#pragma once

#include <Eigen/Core>

#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

/// What the wheels' distances and turns must be multiplied by (wheel size, tyre wear, tread, skid), and what
/// else lies between them and the pictures.
struct OdometryScales {
  double distance = 1;
  double yaw = 1;
  double slip_s = 0;            ///< sideways speed per speed and yaw rate: outwards in a curve when negative
  double camera_latency_s = 0;  ///< pictures are so much older than their stamps
  double turn_lead_s = 0;       ///< turning is told so much earlier than the way, as by a gyro beside wheels
  double yaw_bias_rad_s = 0;    ///< turning that is told where there is none

  static constexpr int kCount = 6;
  using Vector = Eigen::Matrix<double, kCount, 1>;
  /// In the order above, which is that of every Jacobian and covariance.
  [[nodiscard]] Vector vector() const {
    return {distance, yaw, slip_s, camera_latency_s, turn_lead_s, yaw_bias_rad_s};
  }
  [[nodiscard]] static OdometryScales of(const Vector& v) { return {v[0], v[1], v[2], v[3], v[4], v[5]}; }
};

/// A motion on the floor measured by wheels, from base at A to base at B. The twist log(measured) = (x, y,
/// yaw) is taken as constant and its parts scaled.
struct OdometryFactor {
  SE2 measured{};  ///< a_X_b
  Eigen::Matrix3d whitening = Eigen::Matrix3d::Identity();
  double duration_s = 0;  ///< from A to B; 0: not known, then slip and bias are passed over
  SE2::Tangent rate_change = SE2::Tangent::Zero();  ///< twist per second at B less that at A
};

/// J_r_X of the whitened residual.
struct OdometryJacobians {
  Eigen::Matrix<double, 3, 6> a;
  Eigen::Matrix<double, 3, 6> b;
  Eigen::Matrix<double, 3, OdometryScales::kCount> scales;
};

/// The motion once scaled: where B is by the wheels, seen from A.
[[nodiscard]] SE2 scaled_motion(const OdometryFactor& factor, const OdometryScales& scales);

/// Whitened residual: the twist (x, y [m], heading [rad]) that wheels should tell of the motion from A to B
/// less the one they told. Scales and slip are applied to the motion between the poses, for the wheels are
/// what errs: a number fitted to a measured turn is drawn towards zero by the noise of that turn (errors in
/// variables; Fuller, "Measurement Error Models", 1987, section 1.1). A wheel does not see slip
/// (y += slip dx dyaw / duration); pictures that are late saw the motion of a little earlier (less latency *
/// rate_change, to first order), and turning that is told ahead of the way, that of earlier still. Heading is
/// about the z axis of base at A; height and tilts do not enter.
[[nodiscard]] Eigen::Vector3d odometry_residual(const OdometryFactor& factor, const OdometryScales& scales,
                                                const SE3& map_T_a, const SE3& map_T_b,
                                                OdometryJacobians* J = nullptr);

}  // namespace waymark
