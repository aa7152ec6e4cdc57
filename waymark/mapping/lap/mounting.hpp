#pragma once

#include <algorithm>
#include <array>
#include <optional>

#include "waymark/mapping/lap/lap_bundle.hpp"

namespace waymark {

/// Where the camera sits by what a lap says, when the robot's file is only assumed.
struct MountingEstimate {
  SE3 base_T_cam{};
  /// From where it was assumed: x, y, z [m] in base axes, rotation about them [rad].
  Vector6 off = Vector6::Zero();
  Vector6 sigma = Vector6::Zero();  ///< of each, one standard deviation
  std::array<bool, 6> out{};        ///< which are farther off than chance, and far enough to matter
  /// Which of the six are known too badly to say anything against what was assumed.
  std::array<bool, 6> unobservable{};
  OdometryScales scales{};  ///< of the wheels, slip and latency
  OdometryScales scales_sigma{};
  CameraModel camera;            ///< the first, as it was found
  double focal_scale = 1;        ///< its focal length over the given one
  double focal_scale_sigma = 0;  ///< 0: it was taken as given

  [[nodiscard]] bool stands_out() const { return std::ranges::find(out, true) != out.end(); }
};

/// What was assumed of a mounting before, and what a first estimate made of it.
struct MountingAssumption {
  SE3 base_T_cam{};  ///< as the robot's file has it
  Vector6 off = Vector6::Zero();
  /// Which of the six stay as the file has them.
  std::array<bool, 6> trusted{};
  double focal_share = 0;  ///< by which the focal length of the first camera may be off; 0: it is known
};

/// Frees the camera's mounting (but for its height, which nothing on a floor tells), side slip and the age of
/// the pictures, and adjusts everything once more; the bundle stays there. All three belong together: in a
/// curve driven at one speed a robot that slips looks like one whose camera sits elsewhere. `assumption`:
/// unless the camera is assumed where the bundle has it, or nothing of it is to be trusted. Nothing without
/// odometry: tags alone say where the camera went, never where the base is.
[[nodiscard]] std::optional<MountingEstimate> estimate_mounting(
    LapBundle& lap, int max_iterations, const BundleProgress& progress,
    const std::optional<MountingAssumption>& assumption = {});

namespace internal {

/// Of the mean of fx and fy of the first camera over what was given.
[[nodiscard]] double focal_scale_sigma(const Bundle& bundle, const Eigen::MatrixXd& intrinsics_covariance);

/// Numbers of a mounting that stand out count as not told where held-out observations do not confirm them, or
/// where they no longer stand out once the wheels have the noise that they show. Held out: the lap is cut in
/// two of equally many observations, each half estimates the mounting by itself, and what one half found must
/// lower the chi-square of the other, both ways together, against what was assumed (twofold cross-validation:
/// Stone, "Cross-Validatory Choice and Assessment of Statistical Predictions", J. Royal Statistical Society B
/// 36(2), 1974). Errors that the noise model does not have, such as those that corners of one tag share,
/// differ from half to half and do not pass. Where any number passes, those count that stand out with the
/// noise that the wheels show and that the halves confirm, also such as did not stand out before. `freed` is
/// where the estimate ended; it is searched further.
void keep_confirmed(LapBundle& freed, const SE3& assumed, int max_iterations, const BundleProgress& progress,
                    MountingEstimate& mounting);

/// Weighs the wheels by the noise that they show (fit_odometry_noise()); of a long lap, that its middle
/// shows.
void find_odometry_noise(LapBundle& lap, int max_iterations, const BundleProgress& progress);

/// Replaces the standard deviations of mounting, scales and focal length by what the parts of the lap say of
/// them (stretch_covariance()), where there are enough parts. `lap` is where `estimate` was found, tied to a
/// map: tags that only the lap itself places make one of parts far from each other.
void spread_by_stretches(const LapBundle& lap, MountingEstimate& estimate);

}  // namespace internal
}  // namespace waymark
