#pragma once

#include "waymark/mapping/lap/lap_bundle.hpp"

namespace waymark::internal {

/// Odometry corrected to within a few per cent, which is sufficient to start a search.
struct RoughOdometry {
  std::vector<Odometry> odometry{};
  double distance = 1;  ///< factor by which odometry distances were multiplied
  /// Factor by which odometry turns were multiplied or, if gyro turns replace them, would have to be
  /// multiplied.
  double yaw = 1;
  bool turns_by_gyro = false;  ///< turns are those of the gyro, scaled and corrected for its bias
  /// Time spans without gyro samples, during which turns are taken from odometry.
  std::vector<TimeSpan> without_gyro{};
  double without_gyro_share = 0;  ///< share of the odometry's time for which there are no gyro samples
};

/// Compares the motion over one second according to odometry, and to a gyro if there is one, with the motion
/// according to tags. The latter is the motion of the base relative to tags observed both before and after,
/// one tag at a time. It needs no map and no correct tag ids. The scales minimise absolute deviations (as a
/// weighted median of ratios does), so a moved tag, a wrong id or a mirrored pose has little effect. Nearly
/// correct odometry is not changed; the bundle estimates the rest. Gyro turns replace odometry turns if they
/// agree with the tags clearly better, as on a skid-steered robot. Gaps in the gyro samples are filled with
/// odometry turns, multiplied by their estimated scale. O(frames * tags per frame).
[[nodiscard]] RoughOdometry rough_odometry(const LapInput& lap, const std::vector<ObservedFrame>& observed);

}  // namespace waymark::internal
