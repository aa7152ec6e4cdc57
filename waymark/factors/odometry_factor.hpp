#pragma once

#include <Eigen/Core>

#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

/// Scale factors for distances and turns measured by wheels (wheel size, tyre wear, tread, skid), and other
/// systematic errors between wheel and image measurements.
struct OdometryScales {
  double distance = 1;
  double yaw = 1;
  /// Lateral speed per speed and yaw rate; negative if the robot slips outwards in a curve.
  double lateral_slip_s = 0;
  double camera_latency_s = 0;  ///< images were taken this much earlier than their stamps
  double turn_lead_s = 0;     ///< turns are measured this much earlier than distances, as by a separate gyro
  double yaw_bias_rad_s = 0;  ///< yaw rate measured when the robot is at rest

  static constexpr int kCount = 6;
  using Vector = Eigen::Matrix<double, kCount, 1>;
  /// The values in the order above, which all Jacobians and covariances use.
  [[nodiscard]] Vector vector() const {
    return {distance, yaw, lateral_slip_s, camera_latency_s, turn_lead_s, yaw_bias_rad_s};
  }
  [[nodiscard]] static OdometryScales of(const Vector& v) { return {v[0], v[1], v[2], v[3], v[4], v[5]}; }
};

/// A motion on the floor measured by wheels, from the base pose A to the base pose B. The twist log(measured)
/// = (x, y, yaw) is assumed constant and its components are scaled.
struct OdometryFactor {
  SE2 measured{};  ///< a_X_b
  Eigen::Matrix3d whitening = Eigen::Matrix3d::Identity();
  double duration_s = 0;  ///< from A to B; 0 if unknown, in which case slip and bias are ignored
  SE2::Tangent rate_change = SE2::Tangent::Zero();  ///< twist per second at B minus twist per second at A
};

/// Jacobians J_r_X of the whitened residual.
struct OdometryJacobians {
  Eigen::Matrix<double, 3, 6> a;
  Eigen::Matrix<double, 3, 6> b;
  Eigen::Matrix<double, 3, OdometryScales::kCount> scales;
};

/// The scaled motion, that is, the pose of B in A according to the wheels.
[[nodiscard]] SE2 scaled_motion(const OdometryFactor& factor, const OdometryScales& scales);

/// Whitened residual: the twist (x, y [m], heading [rad]) that the wheels should measure for the motion from
/// A to B, minus the measured one. The heading is about the z axis of the base at A; height and tilts are
/// ignored. Wheels do not measure slip (y += slip dx dyaw / duration). Scales and slip are applied to the
/// motion between the poses, because it is the wheels that are noisy. A scale applied to a measured turn
/// would be biased towards zero by the noise of that turn (errors in variables; Fuller, "Measurement Error
/// Models", 1987, section 1.1). With latency, images show the motion at a slightly earlier time (minus
/// latency * rate_change, to first order). If turns are measured before distances, that time is earlier
/// still.
[[nodiscard]] Eigen::Vector3d odometry_residual(const OdometryFactor& factor, const OdometryScales& scales,
                                                const SE3& map_T_a, const SE3& map_T_b,
                                                OdometryJacobians* J = nullptr);

}  // namespace waymark
