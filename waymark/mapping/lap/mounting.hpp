#pragma once

#include <algorithm>
#include <array>
#include <optional>

#include "waymark/mapping/lap/lap_bundle.hpp"

namespace waymark {

/// A camera mounting estimated from a lap.
struct MountingEstimate {
  SE3 base_T_cam{};
  /// Offset from the assumed mounting: x, y, z in base axes [m], and rotations about these axes [rad].
  Vector6 off = Vector6::Zero();
  Vector6 sigma = Vector6::Zero();  ///< standard deviation of each component
  std::array<bool, 6> out{};        ///< whether each component is significant and large enough to matter
  /// Whether each component is too uncertain to question the assumed value.
  std::array<bool, 6> unobservable{};
  OdometryScales scales{};  ///< scales of odometry, side slip and latency
  OdometryScales scales_sigma{};
  CameraModel camera;            ///< the first camera, with the estimated parameters
  double focal_scale = 1;        ///< its focal length relative to the given one
  double focal_scale_sigma = 0;  ///< 0 if not estimated

  [[nodiscard]] bool any_significant() const { return std::ranges::find(out, true) != out.end(); }
};

/// The assumed mounting, and the result of a first estimate.
struct MountingAssumption {
  SE3 base_T_cam{};  ///< from the robot file
  Vector6 off = Vector6::Zero();
  /// Whether each of the six components keeps its value from the robot file.
  std::array<bool, 6> trusted{};
  /// Relative standard deviation of the first camera's focal length; 0 if it is exact.
  double focal_share = 0;
};

/// Makes the camera mounting (except its height, which is not observable on a floor), the side slip and the
/// camera latency unknowns, and adjusts everything again. The result is stored in the bundle. The three must
/// be estimated together, because in a curve at constant speed, slip has the same effect as a different
/// camera mounting. `assumption`: required if the assumed mounting is not the one in the bundle, or if parts
/// of it are trusted. Empty without odometry, because tags alone determine the camera trajectory but not the
/// base.
[[nodiscard]] std::optional<MountingEstimate> estimate_mounting(
    LapBundle& lap, int max_iterations, const BundleProgress& progress,
    const std::optional<MountingAssumption>& assumption = {});

namespace internal {

/// Standard deviation of the mean focal length (fx, fy) of the first camera, relative to the given values.
[[nodiscard]] double focal_scale_sigma(const Bundle& bundle, const Eigen::MatrixXd& intrinsics_covariance);

/// Marks significant mounting parameters as unobservable if held-out observations do not confirm them, or if
/// they are no longer significant with the estimated odometry noise. For this, the lap is split into two
/// halves with the same number of observations, and the mounting is estimated from each half separately. The
/// estimate from one half must reduce the chi-square of the other half relative to the assumed mounting,
/// summed over both directions (twofold cross-validation; Stone, "Cross-Validatory Choice and Assessment of
/// Statistical Predictions", J. Royal Statistical Society B 36(2), 1974). Errors outside the noise model,
/// such as errors common to all corners of one tag, differ between the halves and are not confirmed. If any
/// parameter passes, all parameters that are significant with the estimated odometry noise and confirmed by
/// the halves are kept, including those that were not significant before. `freed`: the bundle containing the
/// estimate, from which the search continues.
void keep_confirmed(LapBundle& freed, const SE3& assumed, int max_iterations, const BundleProgress& progress,
                    MountingEstimate& mounting);

/// Weights odometry according to its estimated noise (see fit_odometry_noise()). For a long lap, the noise is
/// estimated from its middle part.
void find_odometry_noise(LapBundle& lap, int max_iterations, const BundleProgress& progress);

/// Replaces the standard deviations of the mounting, the scales and the focal length with those estimated
/// from the scatter between parts of the lap (see stretch_covariance()). Does nothing if there are too few
/// parts. `lap`: the bundle that `estimate` was computed from. It must be tied to a map, because tags placed
/// only by the lap itself would correlate distant parts.
void spread_by_stretches(const LapBundle& lap, MountingEstimate& estimate);

}  // namespace internal
}  // namespace waymark
